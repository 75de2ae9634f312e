"""Tables as Markdown."""

from pipeline.report.run.tables.cells import markdown


def test_markdown_has_one_line_a_row() -> None:
    assert markdown((["a", "b"], [["1", "2"]])) == "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
