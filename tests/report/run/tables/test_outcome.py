"""The run in one table, by hand."""

import math
from dataclasses import replace

import pytest

from pipeline.report.drawing.styles import styles
from pipeline.report.run.results import InformativePull
from pipeline.report.run.tables.cells import NONE
from pipeline.report.run.tables.outcome import outcome_table, values
from tests.report.run.conftest import confidence
from tests.report.run.tables.toy_results import floor, launches, result, results

MAIN, THEIRS = "least_squares", "sling2sim2real"
NAMED = styles([MAIN, THEIRS])


def test_a_row_a_band_with_errors_predictions_and_failures() -> None:
    trials = launches([[0.03, -0.01]] * 3)
    trials = trials.assign(
        predicted_y=0.98 * trials.landing_y,
        predicted_low=0.95 * trials.landing_y,
        predicted_high=1.05 * trials.landing_y,
    )
    ran = results(
        result("band1", MAIN, trials),
        result("band1", THEIRS, launches([[0.1] * 5] * 3, failed=15)),
        floors={"band1": floor((0.01,) * 3, (0.01,) * 3)},
    )
    heads, (row,) = outcome_table(ran, (MAIN, THEIRS), NAMED)
    assert dict(zip(heads, row, strict=True)) == {
        "band": "band1",
        "launches": "6 virtual",
        "ours [cm]": "2.0",
        "Sling2Sim2Real [cm]": "N/A",
        "actuation floor [cm]": "1.0",
        "ours / floor": "2.0",
        "failed: ours · Sling2Sim2Real": "0 · 15",
        "prediction off by [%]": "2.0",
        "bias [%]": "-2.0",
        "in the 90 % interval": "6 of 6, median width 10 %",
    }


def test_the_pull_with_a_dip_has_a_row_below_its_band() -> None:
    ran = results(
        result("band1", MAIN, launches([[0.03, -0.01]] * 3)),
        result("band1", THEIRS, launches([[0.1] * 5] * 3)),
        floors={"band1": floor((0.01,) * 3, (0.01,) * 3)},
    )
    dip = InformativePull("band1", launches([[0.01, -0.01]] * 3))
    heads, (first, second) = outcome_table(
        replace(ran, dips={"band1_dip": dip}), (MAIN, THEIRS), NAMED
    )
    summary = dict(zip(heads, second, strict=True))
    assert first[0] == "band1" and second[0] == "band1, pull with dips"
    assert (summary["ours [cm]"], summary["Sling2Sim2Real [cm]"]) == ("1.0", NONE)
    assert (summary["actuation floor [cm]"], summary["ours / floor"]) == ("1.0", "1.0")


def test_measured_launches_without_a_target_have_predictions_alone() -> None:
    plain = launches([[0.0]], "measured", targets=[2.0]).assign(target=math.nan, predicted_y=1.9)
    heads, (row,) = outcome_table(results(result("mine", MAIN, plain)), (MAIN,), NAMED)
    assert heads == ["band", "launches", "prediction off by [%]", "bias [%]"]
    assert row == ["mine", "1 measured", "5.0", "-5.0"]


def test_no_launch_is_no_table() -> None:
    nothing = launches([[math.nan]] * 3, "predicted")
    assert outcome_table(results(result("mine", MAIN, nothing)), (MAIN,), NAMED) is None


def test_values_of_a_band_with_and_without_intervals() -> None:
    trials = launches([[0.0]] * 3)
    with_intervals = results(result("mine", MAIN, trials))
    heads, (row,) = values(with_intervals, ["mine"], MAIN)
    assert heads == ["band", "E [kPa]", "damping s·d [ms]"]
    assert row == ["mine", "300 (270 – 330)", "2.10 (1.90 – 2.30)"]
    bare = results(result("mine", MAIN, trials, confidence={}))
    assert values(bare, ["mine"], MAIN) == (["band", "E [kPa]"], [["mine", "300"]])
    assert confidence()["derived"]["damping_product"]["value"] == pytest.approx(2.1e-3)
