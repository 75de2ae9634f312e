"""`sling setup`: what is measured becomes `setup:`, and what contradicts is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.setup import LabMeasures, confirmed, fork_of, requested, set_up, shown
from tests.project import DEFAULTS

LEFT, RIGHT = (0.70, 0.1375, 0.42), (0.70, -0.1375, 0.42)  # the target along the base's x
FORK = (0.7, 0, 0.42, 0, 0, -(0.5**0.5), 0.5**0.5)
LOOKING_DOWN = (0.7, 0.0, 1.4, 1.0, 0.0, 0.0, 0.0)  # from 0.98 m above the fork
ASIDE = (0.7, 0.0, 0.98, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "params.yaml"
    file.write_text(DEFAULTS.read_text(encoding="utf-8"), encoding="utf-8")
    return file


@given(
    st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1), st.floats(0.05, 1), st.floats(-3.1, 3.1)
)
def test_the_fork_is_where_its_tips_are(x, y, z, width, yaw) -> None:
    """Frame O as docs/recording.md has it, by its own axes."""
    side = np.array([np.sin(yaw), -np.cos(yaw), 0.0])  # to the right, looking along yaw
    middle = np.array([x, y, z])
    fork = fork_of(middle - width / 2 * side, middle + width / 2 * side)
    for sign in (-1, 1):
        tip = fork.apply(np.array([sign * width / 2, 0, 0]))
        np.testing.assert_allclose(tip, middle + sign * width / 2 * side, atol=1e-9)
    axes = fork.rotation.as_matrix()
    np.testing.assert_allclose(axes[:, 1], [np.cos(yaw), np.sin(yaw), 0], atol=1e-9)
    np.testing.assert_allclose(axes[:, 2], [0, 0, 1], atol=1e-9)


def test_everything_is_written_and_nothing_else_changes(path) -> None:
    before = path.read_text().splitlines()
    measured = LabMeasures(
        left_tip=LEFT,
        right_tip=RIGHT,
        base_to_camera=LOOKING_DOWN,
        floor=-0.2,
        max_force=25.0,
        draw_y=(-0.44, -0.26),
    )
    done = set_up(measured, path)
    assert done["written"] and list(done["changed"])[0] == "max_force"
    setup = load(path).setup
    assert setup.base_to_fork == pytest.approx(FORK, abs=1e-5)
    assert (setup.fork_height, setup.max_force, setup.draw_y) == (0.62, 25.0, (-0.44, -0.26))
    seen = np.eye(4)
    assert setup.camera_to_fork is not None
    seen[:3, :3] = Rotation.from_quat(setup.camera_to_fork[3:]).as_matrix()
    seen[:3, 3] = setup.camera_to_fork[:3]
    np.testing.assert_allclose(seen @ [0, 0, 0, 1], [0, 0, 0.98, 1], atol=1e-5)
    # the fork's y is the base's x, which a camera that looks down has as its x
    np.testing.assert_allclose(seen @ [0, 1, 0, 1], [1, 0, 0.98, 1], atol=1e-4)
    after = path.read_text().splitlines()
    notes = [[line.partition("#")[2] for line in lines if "#" in line] for lines in (before, after)]
    assert notes[0] == notes[1]
    old, new = (YAML(typ="safe").load("\n".join(lines)) for lines in (before, after))
    keys = {key for key, value in new["setup"].items() if old["setup"][key] != value}
    assert keys == done["changed"].keys() and len(keys) == 5
    assert new | {"setup": old["setup"]} == old
    text = shown(done)
    assert "setup.max_force: 30 -> 25" in text and "setup.base_to_fork: null -> [0.7, 0, " in text
    again = set_up(measured, path)
    assert (again["changed"], again["written"]) == ({}, False) and "nothing changes" in shown(again)
    assert path.read_text().splitlines() == after


def test_two_of_three_poses_give_the_fork_in_the_base(path) -> None:
    """By way of the camera alone: no tip was touched."""
    seen = (0.0, 0.0, 0.98, 0.5**0.5, 0.5**0.5, 0.0, 0.0)
    set_up(LabMeasures(base_to_camera=LOOKING_DOWN, camera_to_fork=seen, floor=-0.1), path)
    setup = load(path).setup
    assert setup.base_to_fork == pytest.approx(FORK, abs=1e-5)
    assert setup.fork_height == pytest.approx(0.52)
    touched = {"left_tip": LEFT, "right_tip": RIGHT, "base_to_camera": LOOKING_DOWN}
    done = set_up(LabMeasures(**touched, camera_to_fork=(0.005, *seen[1:])), path)
    assert any(
        "agree: the fork as seen by way of the camera lies 5.0 mm" in x for x in done["checked"]
    )
    with pytest.raises(UserError, match=r"lies 50.0 mm and 0.00 degrees off .*measure the tips or"):
        set_up(LabMeasures(**touched, camera_to_fork=(0.05, *seen[1:])), path)


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ({}, "nothing to set up: give what you measured"),
        ({"left_tip": LEFT}, "the fork needs both tips"),
        (
            {"left_tip": LEFT, "right_tip": (0.7, -0.15, 0.42)},
            "0.2875 m apart, setup.fork_width is",
        ),
        (
            {"left_tip": LEFT, "right_tip": RIGHT, "fork_width": 0.3},
            "0.2750 m apart, --fork-width is 0.3000 m: 25.0 mm differ, and touching explains 4.2",
        ),
        ({"left_tip": LEFT, "right_tip": (0.7, -0.1365, 0.452)}, "right tip is 32 mm higher than"),
        ({"left_tip": LEFT, "right_tip": LEFT}, "are the same place"),
        ({"left_tip": RIGHT, "right_tip": LEFT}, "the target would lie behind the robot"),
        ({"base_to_camera": LOOKING_DOWN}, "setup.base_to_fork is null, so the camera"),
        ({"floor": 0.0}, "--floor: is in the robot's base, in which the fork is not known"),
        (
            {"left_tip": LEFT, "right_tip": RIGHT, "floor": 0.5},
            "the floor would lie above the fork",
        ),
        (
            {"left_tip": LEFT, "right_tip": RIGHT, "base_to_camera": ASIDE},
            "the camera does not look at the fork, which lies 180 degrees off its axis",
        ),
        ({"camera_to_fork": (0.0, 0.9, 0.3, 0.0, 0.0, 0.0, 1.0)}, "lies 72 degrees off its axis"),
        (
            {"camera_to_fork": (0.0, 0.98, 0.0, 0.5**0.5, 0.0, 0.0, 0.5**0.5)},
            "the inverse pose would: is it the base in the camera?",
        ),
        (
            {"camera_to_fork": (0.0, 0.0, 0.98, 0.0, 0.0, 0.0, 1.0)},
            "the camera would stand 0.46 m below the floor",
        ),
        ({"draw_z": (-0.6, -0.1)}, "setup.draw_z: must be above the floor"),
        ({"draw_y": (-0.2, -0.4)}, "setup.draw_y: the first must be less than the second"),
    ],
)
def test_what_contradicts_is_one_line_and_nothing_is_written(path, measured, words) -> None:
    before = path.read_bytes()
    with pytest.raises(UserError) as caught:
        set_up(LabMeasures(**measured), path)
    assert words in str(caught.value) and "\n" not in str(caught.value)
    assert path.read_bytes() == before


def test_a_user_is_asked_and_may_say_no(path, capsys) -> None:
    lines = iter(["0.7,0.1375,0.42", "mm", "700,-137.5,420", "0.7,-0.1375,0.42", *6 * [""]])
    measured = requested(lambda question: next(lines))
    assert measured == LabMeasures(left_tip=LEFT, right_tip=RIGHT)
    summary = capsys.readouterr().err
    assert "must be X,Y,Z, got 'mm'" in summary and "which looks like millimetres (0.7)" in summary
    before = path.read_bytes()
    done = set_up(measured, path, lambda message: confirmed(message, lambda question: "n"))
    assert path.read_bytes() == before and "nothing was written" in shown(done)
    assert "nothing was written" not in capsys.readouterr().err
    assert set_up(measured, path, lambda message: confirmed(message, lambda question: ""))[
        "written"
    ]


def test_the_command_line(path, sling) -> None:
    done = sling("setup", "--max-force=20", "--json", folder=path.parent)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["changed"] == {"max_force": {"old": 30.0, "new": 20.0}}
    assert YAML(typ="safe").load(path.read_text())["setup"]["max_force"] == 20.0
    for arguments, words in (
        ((), "nothing to set up"),
        (("--left-tip", "-0.7,0.1,0.4"), "one that begins with - is joined by =: --left-tip=-..."),
        (("--floor=-520",), "must be in metres, from -10 to 10, got -520, which looks like milli"),
        (("--base-to-camera=1,2,3,0,0,0,2",), "its quaternion must have length 1, not 2"),
    ):
        done = sling("setup", *arguments, folder=path.parent)
        assert done.returncode in (1, 2) and words in done.stderr
        assert done.stderr.count("\n") == 1
