"""Numbers of the tables, by hand; how they are printed, golden/ has."""

import math

import numpy as np
import pandas as pd
import pytest

from pipeline.report.tables.cells import markdown
from pipeline.report.tables.landings import (
    landing_errors,
    prediction_error,
    predictions,
)
from pipeline.report.tables.parameters import at_edge
from sling2sim2real.identification.objective.box import SearchBox


def trials(rows: list[tuple], kind: str = "measured") -> pd.DataFrame:
    """Rows of target, landing, failure, predicted, stretch."""
    frame = pd.DataFrame(rows, columns=["target", "landing_y", "failure", "predicted_y", "stretch"])
    return frame.assign(
        kind=kind, recorded_stretch=1.6, draw_y=-0.3, draw_z=-0.2, hold_force=9.0,
        predicted_failure=None, predicted_low=math.nan, predicted_high=math.nan,
    )  # fmt: skip


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
    errors = landing_errors(launched)
    near, far, total = errors[1.9], errors[2.1], errors["all"]
    assert (near.launches, near.failed) == (2, 0)
    assert near.mean == pytest.approx(0.02) and near.bias == pytest.approx(-0.01)
    assert near.std == pytest.approx(0.02 / math.sqrt(2))
    assert (far.launches, far.failed) == (4, 2)
    assert far.mean == pytest.approx(0.12)
    assert far.std == pytest.approx(0.04 / math.sqrt(2))
    assert (total.launches, total.failed) == (6, 2)
    assert total.mean == pytest.approx(0.07) and total.bias == pytest.approx(0.055)
    assert total.within == pytest.approx(math.sqrt((0.02**2 / 2 + 0.04**2 / 2) / 2))
    deviations = [0.01 - 0.07, 0.03 - 0.07, 0.10 - 0.07, 0.14 - 0.07]
    assert total.std == pytest.approx(math.sqrt(sum(d**2 for d in deviations) / 3))


def test_prediction_error_inside_and_beyond() -> None:
    launched = trials(
        [
            (math.nan, 2.0, None, 2.1, 1.4),  # + 5 %
            (math.nan, 2.0, None, 1.98, 1.6),  # - 1 %, at the limit
            (math.nan, 4.0, None, 3.6, 1.7),  # - 10 %
            (math.nan, 4.0, None, math.nan, 1.9),  # no prediction
        ]
    )
    error = prediction_error(launched)
    assert error["inside"].mean == pytest.approx(0.03) and error["inside"].launches == 2
    assert error["beyond"].mean == pytest.approx(0.10) and error["beyond"].launches == 1
    assert error["all"].mean == pytest.approx(0.16 / 3)
    assert error["inside"].bias == pytest.approx(0.02)
    assert error["beyond"].bias == pytest.approx(-0.10)
    assert (error["beyond"].unpredicted, error["beyond"].tried) == (1, 2)
    assert error["inside"].unpredicted == 0
    text = markdown(predictions(launched))
    assert "+5.0%" in text and "−10.0%" in text and text.count("(beyond)") == 2


def test_edge_of_the_box_on_both_scales() -> None:
    box = SearchBox(
        ("d", "s"), np.array([1e-4, 0.0]), np.array([1e-2, 1.0]), np.array([True, False])
    )
    assert at_edge(1.01e-4, "d", box) and not at_edge(1.2e-4, "d", box) and at_edge(1e-2, "d", box)
    assert at_edge(0.995, "s", box) and not at_edge(0.98, "s", box)
