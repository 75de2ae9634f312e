"""Tables 1, 3 and 4 from constructed launches, by hand."""

import math

import numpy as np
import pandas as pd
import pytest

from pipeline.report.drawing.styles import styles
from pipeline.report.run import paper
from pipeline.report.run.tables.benchmark import (
    ablation,
    as_table,
    benchmark,
    records,
    spread,
)
from pipeline.report.run.tables.landings import LandingErrors
from tests.report.run.tables.toy_results import TARGETS, floor, launches, ran

NAMED = styles(["sling2sim2real", "package_si", "real2sim2real", "mine", "de", "no_work"])
CLOSE = launches([[0.01, 0.03], [-0.02, 0.02], [0.04, -0.04]])
FAR = launches([[0.1, 0.1], [0.2, 0.2], [0.3, 0.3]])


def lines(rows, targets=TARGETS) -> dict[tuple[str, str, str], list[str]]:
    _, cells = as_table(rows, targets, NAMED)
    return {tuple(line[:3]): line[3:] for line in cells}


def test_cells_by_hand() -> None:
    """|miss| 1 and 3, 2 and 2, 4 and 4 cm: deviations 1.41, 0 and 0 within targets."""
    rows = benchmark(ran({"band1 sling2sim2real": CLOSE}))
    cells = lines(rows)["Band 1 (soft)", "Sling2Sim2Real", "virtual"]
    pooled = math.sqrt(2 / 3)
    over_all = np.std([1, 3, 2, 2, 4, 4], ddof=1)
    assert cells[:3] == ["2.00 ± 1.41", "2.00 ± 0.00", "4.00 ± 0.00"]
    assert cells[3:] == [f"2.67 ± {pooled:.2f}", f"{over_all:.2f}", "0 of 6"]


def test_the_papers_rows_stand_below_those_that_ran_in_its_order() -> None:
    methods = "mine", "sling2sim2real", "package_si"
    rows = benchmark(ran({f"band2 {method}": CLOSE for method in methods}))
    assert [(row.method, row.source) for row in rows] == [
        ("package_si", "virtual"),
        ("package_si", "paper, real robot"),
        ("sling2sim2real", "virtual"),
        ("sling2sim2real", "paper, real robot"),
        ("mine", "virtual"),
    ]
    theirs = lines(rows)["Band 2 (medium)", "Package SI", "paper, real robot"]
    assert theirs[:4] == ["60.00 ± 2.74", "34.50 ± 3.32", "**11.00 ± 6.44**", "35.17 ± 4.58"]
    assert theirs[4:] == ["–", "–"]
    table = lines(benchmark(ran({"band3 package_si": CLOSE})))
    assert table["Band 3 (stiff)", "Package SI", "paper, real robot"][:4] == ["N/A"] * 4


def test_partial_failures_are_counted_and_total_ones_are_not_available() -> None:
    trials = {
        "band1 sling2sim2real": launches([[0.1] * 5] * 3, failed=2),
        "band1 package_si": launches([[0.1] * 5] * 3, failed=15),
        "band1 real2sim2real": launches([[0.9] * 5] * 3),  # never within the target area
    }
    table = lines(benchmark(ran(trials)))
    ours = table["Band 1 (soft)", "Sling2Sim2Real", "virtual"]
    assert ours[2:4] == ["10.00 ± 0.00, 2 failed"] * 2 and ours[4:] == ["0.00", "2 of 15"]
    for method in ("Package SI", "Real2Sim2Real"):
        assert table["Band 1 (soft)", method, "virtual"] == [*["N/A"] * 4, "–", "15 of 15"]
    assert spread(LandingErrors(1, 0, 0.05, math.nan, math.nan)) == "5.00"


def test_bold_is_the_lowest_of_equals_that_all_landed() -> None:
    some = launches([[0.0, 0.0]] * 3, failed=1)
    trials = {"band1 sling2sim2real": CLOSE, "band1 package_si": FAR, "band1 mine": some}
    table = lines(benchmark(ran(trials, {"band1": floor((0.001,) * 3, (0.001,) * 3)})))
    ours = table["Band 1 (soft)", "Sling2Sim2Real", "virtual"]
    assert all(cell.startswith("**") == (i in (2, 3)) for i, cell in enumerate(ours))
    assert table["Band 1 (soft)", "mine", "virtual"][0] == "**0.00 ± 0.00**"
    assert table["Band 1 (soft)", "mine", "virtual"][2] == "0.00, 1 failed"
    assert not any("**" in cell for cell in table["Band 1 (soft)", "Package SI", "virtual"])
    assert not any("**" in c for c in table["Band 1 (soft)", "actuation floor", "virtual, oracle"])


def test_virtual_and_measured_launches_of_a_band_stand_apart() -> None:
    both = pd.concat([CLOSE, launches([[0.05]] * 3, "measured")], ignore_index=True)
    plain = launches([[0.5]], "measured", targets=[math.nan])  # aimed at nothing
    only = launches([[math.nan]] * 3, "predicted")
    trials = {"band1 sling2sim2real": both, "orange sling2sim2real": plain, "orange mine": only}
    table = lines(benchmark(ran(trials)))
    assert table["Band 1 (soft)", "Sling2Sim2Real", "virtual"][5] == "0 of 6"
    assert table["Band 1 (soft)", "Sling2Sim2Real", "measured"][:4] == ["5.00"] * 3 + ["5.00"]
    assert not any(band == "orange" for band, *_ in table)  # nothing there was aimed


def test_the_floor_is_a_row_of_its_band() -> None:
    floors = {"band2": floor((0.01, 0.02, 0.03), (0.003, 0.004, 0.005))}
    rows = benchmark(ran({"band2 sling2sim2real": CLOSE}, floors))
    cells = lines(rows)["Band 2 (medium)", "actuation floor", "virtual, oracle"]
    pooled = math.sqrt((9 + 16 + 25) / 3) / 10
    assert cells[:3] == ["1.00 ± 0.30", "2.00 ± 0.40", "3.00 ± 0.50"]
    assert cells[3:] == [f"2.00 ± {pooled:.2f}", "2.00", "0 of 60"]


def test_ablations_stand_in_tables_of_their_own() -> None:
    trials = dict.fromkeys(["band1 de", "band1 no_work", "orange no_work"], FAR)
    trials |= dict.fromkeys(["band1 sling2sim2real", "band2 sling2sim2real"], CLOSE)
    assert {row.method for row in benchmark(ran(trials))} == {"sling2sim2real"}
    third, fourth = (ablation(ran(trials), ms) for ms in (paper.OPTIMISERS, paper.ABLATIONS))
    assert {row.band for row in third} == {"band1"}
    assert {row.band for row in fourth} == {"band1", "orange"}
    table = lines(third)
    assert table["Band 1 (soft)", "DE_L", "virtual"][0] == "10.00 ± 0.00"
    assert not any(method == "Adam_L" for _, method, _ in table)
    assert table["Band 1 (soft)", "DE_L", "paper, real robot"][2] == "**3.00 ± 1.87**"
    order = list(dict.fromkeys(row.method for row in fourth))
    assert order == ["no_work", "sling2sim2real"]
    assert ablation(ran({"band1 sling2sim2real": CLOSE}), paper.OPTIMISERS) == []


def test_other_targets_have_columns_beside_the_papers() -> None:
    rows = benchmark(ran({"band1 sling2sim2real": launches([[0.01, 0.03]], targets=[1.6])}))
    heads, _ = as_table(rows, [1.6], NAMED)
    assert heads[3:8] == ["g = 160.0", "g = 172.5", "g = 192.5", "g = 212.5", "all targets"]
    cells = lines(rows, [1.6])["Band 1 (soft)", "Sling2Sim2Real", "virtual"]
    assert cells[:4] == ["2.00 ± 1.41", "–", "–", "–"]


def test_machines_read_the_same(tmp_path) -> None:
    failing = launches([[0.1] * 5] * 3, failed=5)
    trials = {"band1 sling2sim2real": CLOSE, "band1 package_si": failing}
    rows = benchmark(ran(trials, {"band1": floor((0.01,) * 3, (0.002,) * 3)}))
    records(rows).to_csv(tmp_path / "table1.csv", index=False)
    read = pd.read_csv(tmp_path / "table1.csv", dtype={"target_m": str})
    read = read.set_index(["band", "method", "source", "target_m"])
    ours = read.loc["band1", "sling2sim2real", "virtual", "1.725"]
    assert ours.mean_error_cm == pytest.approx(2) and ours.bias_cm == pytest.approx(2)
    assert ours.std_cm == pytest.approx(math.sqrt(2)) and ours.launches == 2
    total = read.loc["band1", "sling2sim2real", "virtual", "all"]
    assert total.std_within_targets_cm == pytest.approx(math.sqrt(2 / 3))
    gone = read.loc["band1", "package_si", "virtual", "2.125"]
    assert math.isnan(gone.mean_error_cm) and gone.failed == gone.launches == 5
    assert "package_si,virtual,2.125,5,5,N/A" in (tmp_path / "table1.csv").read_text()
    theirs = read.loc["band1", "package_si", "paper, real robot", "all"]
    assert theirs.mean_error_cm == pytest.approx(8.0) and math.isnan(theirs.failed)
    assert read.loc["band1", "actuation floor", "virtual, oracle", "all"].mean_error_cm == 1.0
