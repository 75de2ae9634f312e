"""Launches of a card's replay: what the page is given of the trials."""

import numpy as np
import pandas as pd
import pytest

from pipeline.report.card.inputs import Aims
from pipeline.report.card.page import flights_at, step

GRAVITY = 9.81


def flight(speed: float, time: float) -> np.ndarray:
    """Of a projectile without drag, from 0.1 m behind the fork, at 30 even moments."""
    t = np.linspace(0, time, 30)
    return np.stack([-0.1 + speed * t, 0.5 * t - GRAVITY / 2 * t**2], axis=1)


def test_the_time_between_points_is_that_of_the_fall() -> None:
    assert step(flight(3.0, 0.7)) == pytest.approx(0.7 / 29, rel=1e-3)
    assert step(flight(3.0, 0.7)[:2]) == 0.0


def test_flights_landings_and_intervals_by_target() -> None:
    way = flight(3.0, 0.7)
    row = {"kind": "virtual"}
    flown = row | {"flight_y": way[:, 0], "flight_z": way[:, 1], "landing_y": way[-1, 0]}
    measured = row | {"flight_y": None, "flight_z": None, "landing_y": 1.9, "kind": "measured"}
    trials = pd.DataFrame([{"target": 2.0, **flown}, {"target": 1.7, **measured}])
    aims = Aims(
        target=np.array([2.0, 1.7, 9.0]),
        draw=np.array([[-0.3, -0.15], [-0.29, -0.15], [np.nan, np.nan]]),
        interval=np.array([[1.9, 2.1], [np.nan, np.nan], [np.nan, np.nan]]),
        landing=np.zeros(3),
        hold_force=np.zeros(3),
        stretch=np.zeros(3),
        slope=np.zeros(3),
        samples=np.zeros((3, 0)),
        failure=[None, None, "out of reach"],
    )
    first, second = flights_at(trials, aims)
    assert (first["target"], first["draw"], first["interval"]) == (2000, [-300, -150], [1900, 2100])
    np.testing.assert_allclose(np.reshape(first["flights"][0], (-1, 2)), 1000 * way, atol=0.5)
    assert first["landings"] == [2000]
    assert (second["flights"], second["landings"], second["interval"]) == ([], [1900], None)
    assert second["kind"] == "measured"
