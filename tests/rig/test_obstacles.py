"""What stands in a projectile's way: the rig and the simulator know the same."""

import numpy as np
import pytest

from pipeline.params import Params
from rig.physics.launch import launch as on_the_rig
from sling2sim2real.base.failures import DRAGGED, FOOT, NEVER_LEFT, SHORT, SLACK
from sling2sim2real.simulator import ClampedBand, LaunchSetup, launch
from sling2sim2real.simulator.parameters import Parameters
from tests.project import with_

FIVE = [3.59e5, 0.47, 2e-3, 0.5, 1.0]  # holds a draw of 0.43 m as the rig's band1 does
BAND = Parameters.of("neo_hookean", FIVE)
LOW, HEAVY, STRONG = {"fork_height": 0.1}, {"projectile_mass": 0.5}, {"max_force": 80.0}
CASES = [
    ({}, (-0.40, 0.00), None),
    (STRONG, (-0.60, -0.50), None),  # deep, and just above the floor
    ({}, (-0.05, 0.40), None),  # launched downwards, over the foot
    (STRONG, (-0.30, -0.53), DRAGGED),
    ({}, (-0.90, -0.40), "holding takes"),
    ({}, (-0.15, -0.05), SLACK),
    (LOW, (-0.32, 0.00), None),
    (LOW, (-0.27, -0.11), DRAGGED),
    (LOW, (-0.24, 0.00), SHORT),
    ({"fork_height": 0.05}, (-0.35, -0.04), FOOT),
    (HEAVY, (-0.10, -0.24), NEVER_LEFT),
    (HEAVY, (-0.30, -0.05), None),  # slowly: 0.3 s in the pouch
    (HEAVY | {"fork_height": 0.3}, (-0.30, -0.05), DRAGGED),  # it sags
]


def simulated_of(world: Params) -> tuple[ClampedBand, LaunchSetup]:
    lab = world.setup, world.sling
    return ClampedBand.of(world.bands["band1"], *lab), LaunchSetup.of(*lab)


@pytest.mark.parametrize(("setup", "draw", "expected"), CASES)
def test_rig_and_simulator_agree_on_what_happens(coarse, setup, draw, expected) -> None:
    world = with_(coarse, "setup", **setup)
    simulated = launch(*simulated_of(world), BAND, draw, max_force=world.setup.max_force)
    truth = on_the_rig("band1", world, draw, None)
    assert np.isfinite(truth.landing_y) == (expected is None)
    assert np.isfinite(simulated.landing_y[0]) == (expected is None)
    if expected is None:
        assert simulated.failure == [None]
    else:
        assert truth.failure.startswith(expected) and simulated.failure[0].startswith(expected)
