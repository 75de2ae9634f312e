"""The paper's numbers, read from its own source where that lies beside the repository."""

import re
from pathlib import Path

import pytest

from pipeline.report import paper

SOURCE = Path("../shared/paper/sling2sim2real.tex")
BANDS = {"Soft": "band1", "Medium": "band2", "Stiff": "band3"}
METHODS = {
    "Real2Sim2Real": "real2sim2real",
    "Package SI": "package_si",
    "Sling2Sim2Real": "paper",
    "$DE_{L}$": "de",
    "$BO_{L}$": "bo",
    "$Adam_{L}$": "adam",
    "Sling2Sim2Real$^{-c,-m}$": "no_covariance_no_multistart",
    "Sling2Sim2Real$^{-m}$": "no_multistart",
    "Sling2Sim2Real$^{-c}$": "no_covariance",
    "Sling2Sim2Real$^{-L_{work}}$": "no_work",
}


def printed() -> dict[str, list[tuple[str, str, list[str]]]]:
    """Rows of each table by its label: band, method, cells."""
    if not SOURCE.is_file():
        pytest.skip(f"the paper's source is not there: {SOURCE}")
    text = re.sub(r"(?<!\\)%.*", "", SOURCE.read_text(encoding="utf-8"))
    tables = {}
    for body in re.findall(r"\\begin\{table\}(.*?)\\end\{table\}", text, re.S):
        label = re.search(r"\\label\{(.*?)\}", body)[1]
        rows, band = [], None
        for line in body.split(r"\midrule", 1)[1].split(r"\\"):
            named = re.search(r"\((Soft|Medium|Stiff)\)", line)
            band = BANDS[named[1]] if named else band
            _, *cells = line.split("&")
            method = re.sub(r"~?\\cite\{.*?\}", "", cells[0]).strip() if cells else ""
            method = method.replace(r"\mathcal{L}", "L").replace(r"\text{work}", "work")
            if method in METHODS:
                rows.append((band, METHODS[method], [cell.strip() for cell in cells[1:]]))
        tables[label] = rows
    return tables


def numbers(cell: str) -> tuple[float, ...] | None:
    """Mean and deviation, or one number; None of N/A."""
    if "N/A" in cell:
        return None
    return tuple(float(number) for number in re.findall(r"\d+\.\d+(?:E[+-]\d+)?", cell))


def test_landing_errors_are_those_of_the_paper() -> None:
    """Every cell, and the order of the rows."""
    for label, methods, bands in (
        ("tab:rl_eval", paper.BENCHMARK, 3),
        ("tab:ablation_optimization", paper.OPTIMISERS, 1),
        ("tab:ablation_combined", paper.ABLATIONS, 1),
    ):
        rows = printed()[label]
        assert [method for _, method, _ in rows] == [*methods] * bands
        for band, method, cells in rows:
            assert [numbers(cell) for cell in cells] == list(paper.LANDING[band, method])


def test_parameters_are_those_of_the_paper() -> None:
    rows = printed()["si_loss"]
    assert [method for _, method, _ in rows] == [*paper.BENCHMARK] * 3
    assert {(band, method) for band, method, _ in rows} == set(paper.THETA)
    for band, method, cells in rows:
        assert tuple(numbers(cell)[0] for cell in cells) == paper.THETA[band, method]


def test_every_number_stands_in_a_table() -> None:
    """What is typed but in no table would never be compared."""
    shown = {*paper.BENCHMARK, *paper.OPTIMISERS, *paper.ABLATIONS}
    assert shown == {method for _, method in paper.LANDING}
    assert {band for band, _ in paper.LANDING} == set(paper.BANDS)


def test_the_papers_rows_average_to_what_it_prints() -> None:
    """One row does not, and the report says so."""
    for (_, method), (*targets, total) in paper.LANDING.items():
        if total:
            mean = sum(cell[0] for cell in targets) / 3
            exception = method == "no_covariance_no_multistart"
            assert (abs(mean - total[0]) > 0.01) == exception
