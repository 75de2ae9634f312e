"""A robot that follows a plan makes a good recording."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.params import load
from sling2sim2real import Band
from sling2sim2real.base.errors import UserError
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


@dataclass(frozen=True)
class Repeated(Followed):
    """Pull after pull; `moments` are the grasp and the release of each."""

    moments: tuple[tuple[float, float], ...] = ()

    def at(self, t: float) -> Followed:
        """The pull that is going on or was the last."""
        begun = [moment for moment in self.moments if moment[0] <= t] or self.moments[:1]
        return Followed(*begun[-1][:1], release=begun[-1][1], draw=self.draw, way=self.way)

    def holds(self, t: float) -> bool:
        return self.at(t).holds(t)

    def force(self, t: float) -> np.ndarray:
        return self.at(t).force(t)

    def center_line(self, t: float) -> np.ndarray:
        return self.at(t).center_line(t)


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


@pytest.mark.slow
def test_a_robot_that_pulls_twice_makes_two_recordings_in_one_file(recorded, tmp_path) -> None:
    plan = plan_recording(recorded[2], BAND, pulls=2)
    way, path = plan.trajectory, tmp_path / "twice.mcap"
    begins = list(zip([phase.name for phase in way.phases], way.times, strict=False))
    grasps = [time for name, time in begins if name == "lift"]
    releases = [time + 3e-4 for name, time in begins if name == "release"]
    moments = tuple(zip(grasps, releases, strict=True))
    write_bag(path, Repeated(end=way.duration, draw=0.4, way=way, moments=moments))
    report = look_at(path, recorded[2], GivenBand.of({}, recorded[2].setup), pull=2).report
    pulls = report["pulls"]
    assert plan.about["pulls"] == len(pulls) == 2
    assert all(pull["usable"] for pull in pulls), str(pulls)
    assert [pull["release_s"] for pull in pulls] == pytest.approx(releases, abs=1e-3)
    assert [pull["grasp_s"] for pull in pulls] == pytest.approx(grasps, abs=0.021)
    assert not any("the pull before" in caution["what"] for caution in report["cautions"])
    with pytest.raises(UserError, match="--pulls: at most 10 in one recording, got 11"):
        plan_recording(recorded[2], BAND, pulls=11)
