"""The Franka's script on a fake that records the commands: it is no robot."""

from __future__ import annotations

import importlib.util
import json
import shutil
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real import Band
from sling2sim2real.cli.plan.plan import Plan, plan_recording
from tests.project import DEFAULTS, ROOT, with_

BAND = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="band1")
FOLDER = ROOT / "examples" / "franka"
FORK = (0.75, 0.0, 0.70, 0.0, 0.0, -(0.5**0.5), 0.5**0.5)
DRAW = (-0.32, -0.05)


def module(name: str, file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec and spec.loader
    script = importlib.util.module_from_spec(spec)
    sys.modules[name] = script  # dataclasses look there
    spec.loader.exec_module(script)
    return script


@pytest.fixture(scope="module")
def execute():
    return module("franka_execute", FOLDER / "execute.py")


@pytest.fixture(scope="module")
def planned(tmp_path_factory) -> tuple[Path, Plan]:
    folder = tmp_path_factory.mktemp("franka")
    params = with_(load(DEFAULTS), "setup", base_to_fork=FORK)
    plan = plan_recording(params, BAND, draw=DRAW)
    plan.write(folder / "plan", 100.0)
    return folder / "plan", plan


class FakeFranka:
    """In franky's place: writes down its commands, and moves nothing."""

    def __init__(self, grasps: bool = True, follows: bool = True) -> None:
        self.summary: list[tuple] = []
        self.grasps = grasps
        error = 0.0 if follows else 0.3
        limit = SimpleNamespace(set=lambda value: self.summary.append(("limit", value)))
        robot = SimpleNamespace(
            recover_from_errors=lambda: None,
            set_collision_behavior=lambda *limits: self.summary.append(("threshold", *limits)),
            move=lambda motion: self.summary.append(("move", motion)),
            state=SimpleNamespace(q=[error] * 7, q_d=[0.0] * 7),
            translation_velocity_limit=limit,
            translation_acceleration_limit=limit,
        )
        future = SimpleNamespace(wait=lambda time: True, get=lambda: self.grasps)

        def tell(name: str, answer: object):
            def message(*values: float) -> object:
                self.summary.append((name, *values))
                return answer

            return message

        hand = SimpleNamespace(
            move=tell("open", True),
            move_async=tell("open", future),
            grasp_async=tell("grasp", future),
        )
        self.RealtimeConfig = SimpleNamespace(Enforce=1, Ignore=0)
        self.Robot = lambda host, realtime_config: robot
        self.Gripper = lambda host: hand
        self.Affine = lambda place, turn: (place, turn)
        self.RobotPose = self.CartesianState = self.CartesianWaypoint = lambda pose: pose
        self.CartesianWaypointMotion = lambda ways: ways[0]
        self.JointMotion = lambda joints: ("joints", *joints)


def run(execute, monkeypatch, fake: FakeFranka, *arguments: str | Path) -> int:
    monkeypatch.setitem(sys.modules, "franky", fake)
    monkeypatch.setattr(execute.time, "sleep", lambda seconds: None)
    return execute.main([*map(str, arguments), "--robot", "fake", "--yes"])


def test_the_fake_is_told_the_plan(execute, planned, monkeypatch) -> None:
    folder, plan = planned
    fake = FakeFranka()
    assert run(execute, monkeypatch, fake, folder) == 0
    moves = [call[1] for call in fake.summary if call[0] == "move"]
    assert moves[0][0] == "joints"
    rows = plan.about["phases"]
    ways = [row for row in rows if row["max_speed_m_s"] > 0]
    for (place, turn), row in zip(moves[2:], ways, strict=True):
        np.testing.assert_allclose(place, row["base"], atol=2e-4)  # of a sample after it
        np.testing.assert_allclose(turn, plan.hand, atol=1e-6)
    fingers = [call for call in fake.summary if call[0] in ("open", "grasp")]
    assert [finger[:2] for finger in fingers] == [
        ("open", 0.08),  # before it begins
        ("grasp", 0.0),
        ("open", 0.08),
    ]
    assert fingers[1][3] == load(DEFAULTS).setup.grip_force
    limits = [call[1] for call in fake.summary if call[0] == "limit"]
    assert max(limits[::2]) <= max(row["max_speed_m_s"] for row in rows) + 1e-9


def answer(folder: Path, **changes) -> Path:
    file = folder / "aim.json"
    content = {"hold_force_n": 9.0, "max_force_n": 30.0, "pull_and_pause_s": [3.0, 1.5]}
    content |= {"tcp_position_m": [0.45, 0.0, 0.6], "tcp_quaternion_xyzw": [0.5, 0.5, 0.5, 0.5]}
    file.write_text(json.dumps(content | changes))
    return file


def test_an_aim_is_drawn_to_from_the_plans_lift(execute, planned, monkeypatch, tmp_path) -> None:
    folder, plan = planned
    legs, _ = execute.legs_of(folder)
    aimed = {leg.name: leg for leg in execute.aimed(legs, answer(tmp_path))}
    assert list(aimed) == "lead-in approach grasp lift pull pause release swing".split()
    assert aimed["pull"].position == (0.45, 0.0, 0.6) and aimed["lift"].position != (0.45, 0.0, 0.6)
    assert aimed["lift"].quaternion == aimed["pull"].quaternion == (0.5, 0.5, 0.5, 0.5)
    assert aimed["approach"].quaternion == pytest.approx(plan.hand, abs=1e-8)
    assert (aimed["pull"].duration, aimed["pause"].duration) == (3.0, 1.5)
    way = np.linalg.norm(np.subtract(aimed["lift"].position, (0.45, 0.0, 0.6)))
    assert aimed["pull"].speed == pytest.approx(2 * way / 3.0)
    fake = FakeFranka()
    assert run(execute, monkeypatch, fake, folder, "--aim", answer(tmp_path)) == 0
    assert fake.summary[-1][:2] == ("open", 0.08)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"refused": "no draw for 3 m"}, "no draw for 3 m"),
        ({"tcp_position_m": None}, "has no pose in the robot's base"),
        ({"hold_force_n": 31.0}, "takes more than setup.max_force"),
    ],
)
def test_an_aim_that_cannot_be_done_moves_nothing(
    execute, planned, monkeypatch, tmp_path, capsys, changes, words
) -> None:
    fake, file = FakeFranka(), answer(tmp_path, **changes)
    assert run(execute, monkeypatch, fake, planned[0], "--aim", file) == 1 and not fake.summary
    message = capsys.readouterr().err
    assert words in message and message.count("\n") == 1


def test_another_frame_or_gripper_moves_nothing(execute, planned, monkeypatch, tmp_path, capsys):
    params = load(DEFAULTS)
    plan_recording(params, BAND).write(tmp_path / "o", 50.0)
    shutil.copytree(planned[0], tmp_path / "gap")
    text = (tmp_path / "gap/gripper.json").read_text().replace("0.04", "0.08")
    (tmp_path / "gap/gripper.json").write_text(text)
    for name, words in (
        ("o", "is in frame O, not in a robot's base"),
        ("gap", "plan with plan.gripper.position: finger"),
        ("none", "No such file"),
    ):
        fake = FakeFranka()
        assert run(execute, monkeypatch, fake, tmp_path / name) == 1 and not fake.summary
        assert words in capsys.readouterr().err


def test_it_stops_where_the_fingers_or_a_joint_fail(execute, planned, monkeypatch, capsys) -> None:
    for fake, words in (
        (FakeFranka(grasps=False), "the fingers did not close on the band"),
        (FakeFranka(follows=False), "the start: joint 1 is 0.30 rad from where it should be"),
    ):
        assert run(execute, monkeypatch, fake, planned[0]) == 1
        assert words in capsys.readouterr().err
        assert not [call for call in fake.summary if call[0] == "open"][1:]
