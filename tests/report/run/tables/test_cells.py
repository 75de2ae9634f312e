"""Tables as markdown and LaTeX: well formed, read back, and compiled where there is a LaTeX."""

import re
import shutil
import subprocess

import pytest

from pipeline.report.drawing.styles import KNOWN, styles
from pipeline.report.run.tables.benchmark import as_table, benchmark
from pipeline.report.run.tables.cells import NAMES, latex, markdown, text
from tests.report.run.tables.toy_results import TARGETS, floor, launches, result, results

TABLE = (
    ["band", "method", "source", "E [kPa]", "± over all"],
    [
        ["my_band", "DE_L", "virtual", "**1.00 ± 0.10**", "50 %"],
        ["my_band", "DE_L", "paper", "N/A", "–"],
        ["other & co", "−c, −m", "virtual", "0.45 ⚠ †", "#1"],
    ],
)


def cells(document: str) -> list[list[str]]:
    """Cells of the body, as a reader of the source sees them."""
    body = document.split(r"\midrule", 1)[1].split(r"\bottomrule")[0]
    lines = [line.strip() for line in body.splitlines()]
    rows = [line.removesuffix(r"\\") for line in lines if line.endswith(r"\\")]
    return [[cell.strip() for cell in re.split(r"(?<!\\)&", row)] for row in rows]


def test_rows_read_back() -> None:
    document = latex(TABLE, "Errors in %", "tab:toy", ("landing error", 4, 5))
    assert cells(document) == [
        [r"my\_band", r"$DE_{\mathcal{L}}$", "virtual", r"\textbf{1.00 $\pm$ 0.10}", r"50 \%"],
        ["", "", "paper", "N/A", "--"],
        [r"other \& co", NAMES["−c, −m"], "virtual", r"0.45 $\ast$ $\dagger$", r"\#1"],
    ]
    assert r"\begin{tabular}{lllcc}" in document and r"\caption{Errors in \%}" in document
    assert r"& & & \multicolumn{2}{c}{landing error} \\" in document
    assert r"\cmidrule(lr){4-5}" in document


def test_what_opens_is_closed_and_nothing_but_ascii_is_left() -> None:
    document = table_1()
    assert document.isascii()
    opened, closed = (re.findall(rf"\\{word}\{{(\w+)\}}", document) for word in ("begin", "end"))
    assert opened == closed[::-1] == ["table", "tabular"]
    plain = re.sub(r"\\[{}]", "", document)
    assert plain.count("{") == plain.count("}") and document.count("$") % 2 == 0
    columns = len(re.search(r"begin\{tabular\}\{(\w+)\}", document)[1])
    assert {len(row) for row in cells(document)} == {columns}


def test_signs_of_latex_are_spelled_out() -> None:
    assert text("50 % of {a_b} & $5 #1 |x|") == r"50 \% of \{a\_b\} \& \$5 \#1 $|$x$|$"
    assert text("~^\\") == r"\textasciitilde{}\textasciicircum{}\textbackslash{}"
    assert text("**a** and *b*") == r"\textbf{a} and \emph{b}"


def test_every_name_that_is_no_ascii_is_known() -> None:
    for name, _ in KNOWN.values():
        assert (NAMES.get(name) or text(name)).isascii()


def table_1() -> str:
    trials = launches([[0.01, 0.03]] * 3, failed=1)
    ran = [result("band1", method, trials) for method in KNOWN]
    floors = {"band1": floor(*[(0.01,) * 3] * 2)}
    rows = benchmark(results(*ran, result("my_band", "de", trials), floors=floors))
    table = as_table(rows, TARGETS, styles(KNOWN))
    return latex(table, "Mean ± deviation of |landing − target|.", "tab:1", ("error [cm]", 4, 8))


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="pdflatex is not installed")
def test_it_compiles(tmp_path) -> None:
    parts = [table_1(), latex(TABLE, "Toy", "tab:toy")]
    document = "\n".join(
        [
            r"\documentclass{article}\usepackage{booktabs,graphicx}\begin{document}",
            *parts,
            r"\end{document}",
        ]
    )
    (tmp_path / "toy.tex").write_text(document)
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "toy.tex"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stdout[-2000:]
    assert (tmp_path / "toy.pdf").is_file()


def test_markdown_has_one_line_a_row() -> None:
    assert markdown((["a", "b"], [["1", "2"]])) == "| a | b |\n| --- | --- |\n| 1 | 2 |\n"
