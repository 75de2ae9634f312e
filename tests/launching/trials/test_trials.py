"""Trials: what a virtual world leaves in them, their table, and the limit of the arm."""

from types import SimpleNamespace

import numpy as np

from pipeline.params import load
from sling2sim2real.launching.trials import trials as module
from sling2sim2real.launching.trials.trials import SCHEMA, launch_virtually, predicted, table
from sling2sim2real.simulator.launch import Launches, launch, limited
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS, with_

PREDICTED = Launches(
    landing_y=np.array([1.9, np.nan, 2.0]),
    speed=np.array([4.5, np.nan, 4.7]),
    angle=np.array([0.5, np.nan, 0.5]),
    hold_force=np.array([9.0, np.nan, 31.0]),
    separation_time=np.array([0.04, np.nan, 0.04]),
    separation_y=np.array([-0.05, np.nan, -0.06]),
    separation_z=np.array([-0.03, np.nan, -0.03]),
    failure=[None, "it broke", None],
)


DRAWS = [[-0.3, -0.17], [-0.31, -0.17], [-0.32, -0.18]]


def trials_of(*kinds: str) -> list[dict]:
    places = zip(kinds, DRAWS, strict=False)
    return [{"kind": kind, "target": 1.9, "draw_y": y, "draw_z": z} for kind, (y, z) in places]


def made(trials: list[dict], monkeypatch) -> dict[str, list]:
    intervals = np.array([[1.8, 2.0], [np.nan, np.nan], [1.9, 2.1]])[::-1]  # by the draw
    monkeypatch.setattr(module, "landing_intervals", lambda *args: intervals)
    with_limit = with_(load(DEFAULTS), "setup", max_force=40.0)
    rows = predicted(trials, lambda draws: PREDICTED, None, with_limit)
    whole = table(rows, [1.4, 1.4, 1.4], band="toy", method="ours", recorded_stretch=1.6)
    assert whole.schema.equals(SCHEMA)
    return whole.to_pydict()


def test_a_table_holds_what_is_known_and_nothing_else(monkeypatch) -> None:
    flight = np.array([[-0.05, -0.03], [1.0, 0.2], [1.95, -0.52]])
    monkeypatch.setattr(module, "Pool", InProcess)
    done = iter(
        [
            SimpleNamespace(landing_y=1.95, failure=None, hold_force=9.1, flight=flight),
            SimpleNamespace(landing_y=np.nan, failure="far", hold_force=9.2, flight=flight[:2]),
            SimpleNamespace(landing_y=np.nan, failure="strong", hold_force=31.5, flight=None),
        ]
    )
    tried = launch_virtually(trials_of(*3 * ["predicted"]), lambda draw, place: next(done))
    rows = made(tried, monkeypatch)
    assert rows["kind"] == ["virtual"] * 3 and rows["band"] == ["toy"] * 3
    assert rows["draw_y"] == [-0.3, -0.31, -0.32] and rows["draw_z"] == [-0.17, -0.17, -0.18]
    assert rows["predicted_y"] == [1.9, None, 2.0]
    assert rows["predicted_low"] == [1.8, None, 1.9]
    assert rows["predicted_high"] == [2.0, None, 2.1]
    assert rows["predicted_leave_y"] == [-0.05, None, -0.06]
    assert rows["predicted_leave_z"] == [-0.03, None, -0.03]
    assert rows["predicted_speed"] == [4.5, None, 4.7]
    assert rows["predicted_angle"] == [0.5, None, 0.5]
    assert rows["landing_y"] == [1.95, None, None]
    assert rows["hold_force"] == [9.1, 9.2, 31.5]  # the rig's own
    assert rows["flight_y"] == [[-0.05, 1.0, 1.95], [-0.05, 1.0], None]
    assert rows["flight_z"] == [[-0.03, 0.2, -0.52], [-0.03, 0.2], None]


class InProcess:
    """In the place of a pool: here, one after the other."""

    map = staticmethod(map)

    def __enter__(self):
        return self

    def __exit__(self, *args) -> None:
        pass


def test_the_limit_is_the_simulators_own() -> None:
    """Launched with a limit, or limited afterwards: the same; other failures stay."""
    weak = limited(PREDICTED, 30.0).failure
    assert weak == [None, "it broke", "holding takes 31.0 N, more than 30 N"]
    assert limited(PREDICTED, 31.0).failure == PREDICTED.failure
    params = load(DEFAULTS)
    lab = params.setup, params.sling
    world = ClampedBand.of(params.bands["band1"], *lab), LaunchSetup.of(*lab)
    draws, theta = np.array([[-0.28, -0.1], [-0.44, -0.28]]), np.array([2e5, 0.45, 2e-3, 0.5, 0.5])
    theta = Parameters.of(world[0].law, theta)
    free = launch(*world, theta, draws)
    limit = float(free.hold_force.mean())
    expected, result = launch(*world, theta, draws, max_force=limit), limited(free, limit)
    assert result.failure == expected.failure and result.failure[0] is None
    for name in ("landing_y", "speed", "angle", "separation_y", "separation_z", "hold_force"):
        np.testing.assert_array_equal(getattr(result, name), getattr(expected, name))
