"""The texts and tables of a finished run of exact inputs, as committed in golden/."""

from pathlib import Path

import pytest

from pipeline.report.report import write
from tests.golden import expect_golden
from tests.report.toy_run import run_of, write_run

GOLDEN = Path(__file__).parent / "golden"
TABLES = [f"table{number}.csv" for number in (1, 2, 3, 4)]


@pytest.mark.usefixtures("no_simulation", "text_alone")
def test_the_texts_and_tables_of_a_finished_run(root, params) -> None:
    write_run(root)
    write(run_of(params), root)
    reports = root / "reports"
    assert {file.name for file in (reports / "tables").iterdir()} == {*TABLES}
    for name in ("appendix.md", "README.md", "summary.json", *(f"tables/{n}" for n in TABLES)):
        expect_golden((reports / name).read_text("utf-8"), GOLDEN / Path(name).name)
