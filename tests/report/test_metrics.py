"""Metrics: few, flat, and the numbers of the tables."""

from __future__ import annotations

import math

import pytest

from pipeline.report.write import metrics
from tests.report.tables.toy_results import floor, launches, result, results


def test_a_rig_band_shows_its_errors_beside_the_floor() -> None:
    plain, robust = launches([[0.03, -0.01]] * 3), launches([[0.02, 0.02]] * 3)
    ran = results(
        result("band1", "ours", plain, robust_trials=robust),
        result("band1", "theirs", launches([[0.1] * 5] * 3, failed=15)),
        floors={"band1": floor((0.01, 0.02, 0.03), (0.01,) * 3)},
    )
    assert metrics(ran) == {
        "band1-ours": {
            "loss": 1.5,
            "policy_cm": 0.4,
            "floor_cm": 2.0,
            "virtual_cm": 2.0,
            "virtual_failed": 0,
            "robust_cm": 2.0,
            "robust_failed": 0,
        },
        "band1-theirs": {
            "loss": 1.5,
            "policy_cm": 0.4,
            "floor_cm": 2.0,
            "virtual_cm": None,
            "virtual_failed": 15,
        },
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
    entry = metrics(results(result("mine", "ours", only, robust_trials=only)))["mine-ours"]
    assert entry == {"loss": 1.5, "policy_cm": 0.4}
