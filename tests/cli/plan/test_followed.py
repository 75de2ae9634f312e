"""A robot that follows a plan makes a good recording."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.params import load
from sling2sim2real import Band
from sling2sim2real.cli.plan.plan import plan_recording
from sling2sim2real.cli.plan.trajectory import Trajectory
from sling2sim2real.cli.preflight.check import GivenBand, look_at
from tests.project import DEFAULTS, with_
from validation.recordings.bag import BASE, HAND, Truth, write_bag


@dataclass(frozen=True)
class Followed(Truth):
    """The small recording's world, with the hand where the plan has it."""

    way: Trajectory | None = None

    def hand(self, t: float) -> np.ndarray:
        return self.way.position(t)


pytestmark = pytest.mark.usefixtures("nowhere")

BAND = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="band1")
FAST = {"max_speed": 0.8, "pull_speed": 0.5, "max_acceleration": 5.0, "hanging": 0.195}
FAST |= {"lead_in": 0.6, "finger_time": 0.3, "pause": 0.8, "wait": 0.5}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(path, plan, params) of a recording by a robot that follows a plan, with pictures."""
    inverse = BASE[0].inv()
    fork_in_base = (*inverse.apply(-BASE[1]), *inverse.as_quat())
    whole = load(DEFAULTS)
    placed = with_(whole, "setup", base_to_fork=tuple(map(float, fork_in_base)))
    params = with_(with_(placed, "plan", **FAST), "episode", duration=4.2, samples=140, tail=0.5)
    plan = plan_recording(params, BAND)
    way, release = plan.trajectory, plan.trajectory.start_of("release") + 3e-4
    truth = Followed(
        grasp=way.start_of("lift"), release=release, end=way.duration, draw=0.4, way=way
    )
    path = tmp_path_factory.mktemp("plan") / "followed.mcap"
    write_bag(path, truth)
    return path, plan, params, truth


def test_a_robot_that_follows_the_plan_makes_a_recording_that_check_accepts(recorded) -> None:
    path, plan, params, truth = recorded
    np.testing.assert_allclose(
        Rotation.from_quat(plan.hand).as_matrix(), (BASE[0].inv() * HAND).as_matrix(), atol=1e-9
    )
    report = look_at(path, params, GivenBand.of({}, params.setup)).report
    assert report["problem"] is None
    assert report["signals"]["release_s"] == pytest.approx(truth.release, abs=1e-3)
    assert report["signals"]["draw_m"] == pytest.approx([0, -0.4, 0], abs=1e-3)
