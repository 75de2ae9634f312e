"""What stands in a projectile's way: the rig, the simulator, training and aiming know the same."""

import json

import numpy as np
import pytest
import torch

from app.aim import aim, why_refused
from pipeline.base.failures import DRAGGED, FOOT, NEVER_LEFT, SHORT, SLACK
from pipeline.launching.surface.landing_map import LandingMap
from pipeline.params import Params
from pipeline.policy.environment import SlingshotEnv
from pipeline.simulator import ClampedBand, LaunchSetup, launch
from pipeline.simulator.parameters import THETA, Parameters
from rig.physics.launch import launch as on_the_rig
from tests.policy.linear import write_policy
from tests.project import with_

FIVE = [1.86e5, 0.47, 2e-3, 0.5, 1.0]  # holds a draw of 0.43 m as the rig's band1 does
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


@pytest.fixture(scope="module")
def low(params):
    """A fork of 10 cm and its launches."""
    world = with_(params, "setup", **LOW)
    band, setup = simulated_of(world)
    return world, lambda draws, thetas=None: launch(band, setup, BAND, draws)


def test_training_has_no_reward_for_them(low) -> None:
    world, launcher = low
    box = {"draw_y": (-0.40, -0.15), "draw_z": (-0.13, -0.02), "max_force": 30.0}
    surface = LandingMap.simulate(launcher, size=(17, 12), checks=0, **box).surface
    assert {DRAGGED, SHORT, SLACK} <= {*surface.reasons}
    env = SlingshotEnv(surface, targets=(0.2, 1.5), num_envs=3, seed=1, reward=world.policy.reward)
    draws = torch.tensor([[-0.35, -0.125], [-0.18, -0.03], [-0.38, -0.05]])
    middle, half = torch.tensor([-0.275, -0.075]), torch.tensor([0.125, 0.055])
    _, reward, _, _ = env.step(torch.atanh((draws - middle) / half))
    assert env.take_failures() == {DRAGGED: 1, SLACK: 1}
    penalty = -world.policy.reward.penalty
    assert reward[:2].tolist() == [penalty, penalty] and reward[2] > 0


def test_aiming_says_so(low, tmp_path) -> None:
    world, launcher = low
    name = "sling2sim2real"
    write_policy(tmp_path / f"data/policies/band1/{name}/policy.onnx", (0, 0), (-0.27, -0.11))
    file = tmp_path / f"data/theta/band1/{name}.json"
    file.parent.mkdir(parents=True)
    theta = dict(zip(THETA, FIVE, strict=True))
    file.write_text(json.dumps({"band": "band1", "theta": theta}))
    answer = aim(world, "band1", name, 1.925, tmp_path, launcher=launcher)
    assert answer["predicted_landing_m"] is None and answer["interval_90_m"] is None
    assert f"the launch fails in simulation: {DRAGGED}" == why_refused(answer)
