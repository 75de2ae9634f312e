"""Trials: what a virtual world leaves in them, their table, and the limit of the arm."""

import numpy as np

from pipeline.params import load
from sling2sim2real.launching.trials.trials import SCHEMA, Batch, table
from sling2sim2real.simulator.launch import Launches, launch, limited
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from tests.project import DEFAULTS

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


def made(batches: list[Batch], predicted: Launches = PREDICTED) -> dict[str, list]:
    whole = table(
        "toy",
        "ours",
        batches,
        predicted=predicted,
        intervals=np.array([[1.8, 2.0], [np.nan, np.nan], [1.9, 2.1]]),
        stretch=np.array([1.4, 1.4, 1.4]),
        recorded=1.6,
    )
    assert whole.schema.equals(SCHEMA)
    return whole.to_pydict()


DRAWS = [[-0.3, -0.17], [-0.31, -0.17], [-0.32, -0.18]]


def test_a_table_holds_what_is_known_and_nothing_else() -> None:
    flight = np.array([[-0.05, -0.03], [1.0, 0.2], [1.95, -0.52]])
    tried = Batch(
        kind="virtual",
        draws=np.array(DRAWS),
        targets=[1.9, 1.9, 2.1],
        landing=[1.95, None, None],
        failure=[None, "too far", "too strong"],
        hold_force=[9.1, 9.2, 31.5],
        flight=[flight, flight[:2], None],
    )
    rows = made([tried])
    assert rows["trial"] == [1, 2, 1]
    assert rows["draw_y"] == [-0.3, -0.31, -0.32] and rows["draw_z"] == [-0.17, -0.17, -0.18]
    for name, expected in {
        "predicted_y": [1.9, None, 2.0],
        "predicted_low": [1.8, None, 1.9],
        "predicted_leave_z": [-0.03, None, -0.03],
        "predicted_speed": [4.5, None, 4.7],
    }.items():
        assert rows[name] == expected
    assert rows["landing_y"] == [1.95, None, None]
    assert rows["hold_force"] == [9.1, 9.2, 31.5]  # the rig's own
    assert rows["flight_y"] == [[-0.05, 1.0, 1.95], [-0.05, 1.0], None]
    assert rows["flight_z"] == [[-0.03, 0.2, -0.52], [-0.03, 0.2], None]


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
