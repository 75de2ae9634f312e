"""The first page and the metrics say what came out, band by band."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from pipeline.drawing.styles import styles
from pipeline.report.chapters.summary import summary
from pipeline.report.write import metrics
from tests.report.tables.toy_results import floor, launches, result, results

NAMED = styles(["sling2sim2real", "package_si", "real2sim2real", "de"])
CLOSE = launches([[0.03, -0.01]] * 3)


def said(*some, floors=None, unused=None) -> list[str]:
    ran = replace(results(*some, floors=floors), unused=unused or {})
    text = summary(SimpleNamespace(results=ran, styles=NAMED))
    return [line for line in text.splitlines() if line.startswith("- ")]


def test_a_line_a_band_of_the_rig() -> None:
    ran = (
        result("band1", "sling2sim2real", CLOSE),
        result("band1", "package_si", launches([[0.1] * 5] * 3, failed=2)),
        result("band1", "real2sim2real", launches([[0.1] * 5] * 3, failed=15)),
        result("band1", "de", CLOSE),  # left to its table
    )
    (line,) = said(*ran, floors={"band1": floor((0.01,) * 3, (0.01,) * 3)})
    assert line == (
        "- **band1**, virtual launches, mean distance from the target: Sling2Sim2Real 2.0 cm"
        " (2.0 times the floor), Package SI 10.0 cm (2 of 15 launches failed), Real2Sim2Real N/A;"
        " the actuation floor is 1.0 cm."
    )
    assert "floor" not in said(*ran)[0]


def test_what_went_wrong_is_said() -> None:
    card = {"training": {"converged": False, "mean_error_m": 0.05}}
    unpredicted = CLOSE.assign(predicted_y=math.nan)
    lines = said(result("band1", "sling2sim2real", unpredicted, card=card))
    assert "- band1, Sling2Sim2Real: 6 of 6 launches could not be predicted." in lines
    assert any("policy of band1, Sling2Sim2Real did **not** converge" in line for line in lines)


def test_predictions_alone_say_so() -> None:
    lines = said(result("mine", "package_si", launches([[math.nan]] * 3, "predicted")))
    assert lines == ["- mine, Package SI: no launch to compare its predictions with."]


def test_measured_launches_of_a_method_that_does_not_run_are_named() -> None:
    lines = said(result("mine", "package_si", CLOSE), unused={"mine": 3})
    assert lines[-1] == (
        "- mine: 3 measured launches name a method that does not run on this band."
    )


def test_measured_launches_are_judged_by_method() -> None:
    (line,) = said(result("mine", "package_si", launches([[0.02]] * 3, "measured")))
    assert line.startswith("- **mine, Package SI**: measured launches land 2.0 cm off their target")
    assert "the aim, at most 5 % of the distance inside the recorded stretch, is met" in line


def test_a_rig_band_shows_its_errors_beside_the_floor() -> None:
    plain = launches([[0.03, -0.01]] * 3)
    ran = results(
        result("band1", "ours", plain),
        result("band1", "theirs", launches([[0.1] * 5] * 3, failed=15)),
        floors={"band1": floor((0.01, 0.02, 0.03), (0.01,) * 3)},
    )
    common = {"loss": 1.5, "policy_cm": 0.4, "floor_cm": 2.0}
    assert metrics(ran) == {
        "band1-ours": common | {"virtual_cm": 2.0, "virtual_failed": 0},
        "band1-theirs": common | {"virtual_cm": None, "virtual_failed": 15},
    }


def test_measured_launches_show_what_was_predicted() -> None:
    aimed = launches([[0.1]] * 3, "measured")
    plain = launches([[0.0]], "measured", targets=[2.0]).assign(target=math.nan, predicted_y=2.1)
    entry = metrics(results(result("mine", "ours", aimed), result("mine", "theirs", plain)))
    assert entry["mine-ours"]["measured_cm"] == pytest.approx(10)
    off = sum(0.1 / (g + 0.1) for g in (1.725, 1.925, 2.125)) / 3
    assert entry["mine-ours"]["prediction_percent"] == pytest.approx(100 * off, abs=1e-3)
    assert entry["mine-theirs"] == {"loss": 1.5, "policy_cm": 0.4, "prediction_percent": 5.0}


def test_predictions_alone_show_no_error() -> None:
    only = launches([[math.nan]] * 3, "predicted")
    entry = metrics(results(result("mine", "ours", only)))["mine-ours"]
    assert entry == {"loss": 1.5, "policy_cm": 0.4}
