"""Numbers of the tables by hand."""

import math

import pandas as pd
import pytest

from pipeline.report.data import with_errors
from pipeline.report.statistics import ALL, landing_errors, prediction_errors
from pipeline.report.tables import launches as launch_table
from pipeline.report.tables import markdown


def trials(rows: list[tuple]) -> pd.DataFrame:
    """Rows of target, landing, failure, predicted, stretch."""
    frame = pd.DataFrame(rows, columns=["target", "landing_y", "failure", "predicted_y", "stretch"])
    more = {"draw_y": -0.3, "draw_z": -0.2, "hold_force": 9.0, "predicted_failure": None}
    more |= {"predicted_low": math.nan, "predicted_high": math.nan, "recorded_stretch": 1.6}
    names = {"name": "band", "band": "band", "method": "mine", "kind": "measured"}
    return with_errors(frame.assign(**names, **more))


def test_landing_errors_by_hand() -> None:
    launched = trials(
        [
            (1.9, 1.90 + 0.01, None, 1.9, 1.4),
            (1.9, 1.90 - 0.03, None, 1.9, 1.4),
            (2.1, 2.10 + 0.10, None, 2.1, 1.4),
            (2.1, 2.10 + 0.14, None, 2.1, 1.4),
            (2.1, math.nan, "holding takes 31 N", 2.1, 1.4),
            (2.1, 2.50, None, 2.1, 1.4),  # beyond the target area
            (math.nan, 1.0, None, 1.1, 1.4),  # aimed at nothing
        ]
    )
    errors = landing_errors(launched).set_index("target")
    near, far, total = (errors.loc[target] for target in (1.9, 2.1, ALL))
    assert (near.launches, near.failed) == (2, 0)
    assert near["mean"] == pytest.approx(0.02) and near.bias == pytest.approx(-0.01)
    assert near["std"] == pytest.approx(0.02 / math.sqrt(2))
    assert (far.launches, far.failed) == (4, 2)
    assert far["mean"] == pytest.approx(0.12)
    assert far["std"] == pytest.approx(0.04 / math.sqrt(2))
    assert (total.launches, total.failed) == (6, 2)
    assert total["mean"] == pytest.approx(0.07) and total.bias == pytest.approx(0.055)
    assert total.within == pytest.approx(math.sqrt((0.02**2 / 2 + 0.04**2 / 2) / 2))
    deviations = [0.01 - 0.07, 0.03 - 0.07, 0.10 - 0.07, 0.14 - 0.07]
    assert total["std"] == pytest.approx(math.sqrt(sum(d**2 for d in deviations) / 3))


def test_prediction_errors_by_hand() -> None:
    launched = trials(
        [
            (math.nan, 2.0, None, 2.1, 1.4),  # + 5 %
            (math.nan, 2.0, None, 1.98, 1.6),  # - 1 %, at the limit
            (math.nan, 4.0, None, 3.6, 1.7),  # - 10 %
            (math.nan, 4.0, None, math.nan, 1.9),  # no prediction
        ]
    )
    inside, beyond = (
        prediction_errors(launched[launched.inside == side]) for side in (True, False)
    )
    assert (inside["compared"], beyond["compared"]) == (2, 1)
    assert inside["mean"] == pytest.approx(0.03) and inside["bias"] == pytest.approx(0.02)
    assert beyond["most"] == pytest.approx(0.10) and beyond["bias"] == pytest.approx(-0.10)
    assert (beyond["unpredicted"], beyond["tried"], inside["unpredicted"]) == (1, 2, 0)
    assert prediction_errors(launched)["mean"] == pytest.approx(0.16 / 3)
    ranged = launched.assign(predicted_low=[1.9, 2.01, math.nan, 3.0], predicted_high=2.2)
    found = prediction_errors(ranged)
    assert (found["ranged"], found["covered"]) == (3, 1)
    assert found["width"] == pytest.approx(0.19 / 2)
    text = markdown(launch_table(launched))
    assert "+5.0%" in text and "−10.0%" in text and text.count("(beyond)") == 2
