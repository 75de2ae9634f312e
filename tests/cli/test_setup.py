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

from sling2sim2real.api.band_folder import lab_settings
from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.setup import fork_of, set_up, shown

LEFT, RIGHT = (0.70, 0.1375, 0.42), (0.70, -0.1375, 0.42)  # the target along the base's x
FORK = (0.7, 0, 0.42, 0, 0, -(0.5**0.5), 0.5**0.5)
LOOKING_DOWN = (0.7, 0.0, 1.4, 1.0, 0.0, 0.0, 0.0)  # from 0.98 m above the fork
ASIDE = (0.7, 0.0, 0.98, 0.0, 0.0, 0.0, 1.0)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A lab.yaml with settings of its own."""
    file = tmp_path / "bands/lab.yaml"
    file.parent.mkdir()
    file.write_text("plan: {pause: 1.5}\nsetup: {foot_height: 0.01}\n", encoding="utf-8")
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
    measured = dict(
        left_tip=LEFT,
        right_tip=RIGHT,
        base_to_camera=LOOKING_DOWN,
        floor=-0.2,
        max_force=25.0,
        draw_y=(-0.44, -0.26),
    )
    done = set_up(measured, path)
    assert list(done["changed"])[0] == "max_force"
    setup = lab_settings(path).setup
    assert setup.base_to_fork == pytest.approx(FORK, abs=1e-5)
    assert (setup.fork_height, setup.max_force, setup.draw_y) == (0.62, 25.0, (-0.44, -0.26))
    seen = np.eye(4)
    assert setup.camera_to_fork is not None
    seen[:3, :3] = Rotation.from_quat(setup.camera_to_fork[3:]).as_matrix()
    seen[:3, 3] = setup.camera_to_fork[:3]
    np.testing.assert_allclose(seen @ [0, 0, 0, 1], [0, 0, 0.98, 1], atol=1e-5)
    # the fork's y is the base's x, which a camera that looks down has as its x
    np.testing.assert_allclose(seen @ [0, 1, 0, 1], [1, 0, 0.98, 1], atol=1e-4)
    new = YAML(typ="safe").load(path.read_text())
    assert new["setup"].keys() == {"foot_height", *done["changed"]} and len(done["changed"]) == 5
    assert new["plan"] == {"pause": 1.5} and new["setup"]["foot_height"] == 0.01
    after = path.read_bytes()
    text = shown(done)
    assert "setup.max_force: 30 -> 25" in text and "setup.base_to_fork: null -> [0.7, 0, " in text
    again = set_up(measured, path)
    assert again["changed"] == {} and "nothing changes" in shown(again)
    assert path.read_bytes() == after


def test_a_tool_and_topics_are_taken_down(path) -> None:
    tool, topics = (0.7, 0.0, 0.0, 0.05), (("wrench", "/ft"), ("pose", "/tcp"))
    set_up(dict(tool=tool, topics=topics), path)
    set_up(dict(topics=(("pose", "/ee"),)), path)
    setup = lab_settings(path).setup
    assert (setup.tool.mass, setup.tool.center) == (0.7, (0.0, 0.0, 0.05))
    assert (setup.topics.wrench, setup.topics.pose) == ("/ft", "/ee")


def test_two_of_three_poses_give_the_fork_in_the_base(path) -> None:
    """By way of the camera alone: no tip was touched."""
    seen = (0.0, 0.0, 0.98, 0.5**0.5, 0.5**0.5, 0.0, 0.0)
    set_up(dict(base_to_camera=LOOKING_DOWN, camera_to_fork=seen, floor=-0.1), path)
    setup = lab_settings(path).setup
    assert setup.base_to_fork == pytest.approx(FORK, abs=1e-5)
    assert setup.fork_height == pytest.approx(0.52)
    touched = {"left_tip": LEFT, "right_tip": RIGHT, "base_to_camera": LOOKING_DOWN}
    done = set_up(dict(**touched, camera_to_fork=(0.005, *seen[1:])), path)
    assert any(
        "agree: the fork as seen by way of the camera lies 5.0 mm" in x for x in done["checked"]
    )
    with pytest.raises(UserError, match=r"lies 50.0 mm and 0.00 degrees off .*measure the tips or"):
        set_up(dict(**touched, camera_to_fork=(0.05, *seen[1:])), path)


@pytest.mark.parametrize(
    ("measured", "words"),
    [
        ({}, "nothing to set up: give what you measured"),
        ({"left_tip": LEFT}, "the fork needs both tips"),
        ({"left_tip": LEFT, "right_tip": LEFT}, "are the same place"),
        ({"floor": 0.0}, "--floor: is in the robot's base, in which the fork is not known"),
        (
            {"left_tip": LEFT, "right_tip": (0.7, -0.15, 0.42)},
            "0.2875 m apart, setup.fork_width is",
        ),
        (
            {"left_tip": LEFT, "right_tip": RIGHT, "fork_width": 0.3},
            "0.2750 m apart, --fork-width is 0.3000 m: 25.0 mm differ, and touching explains 4.2",
        ),
        ({"left_tip": LEFT, "right_tip": (0.7, -0.1365, 0.452)}, "right tip is 32 mm higher than"),
        ({"left_tip": RIGHT, "right_tip": LEFT}, "the target would lie behind the robot"),
        ({"base_to_camera": LOOKING_DOWN}, "setup.base_to_fork is null, so the camera"),
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
    ],
)
def test_what_contradicts_is_one_line_and_nothing_is_written(path, measured, words) -> None:
    before = path.read_bytes()
    with pytest.raises(UserError) as caught:
        set_up(measured, path)
    assert words in str(caught.value) and "\n" not in str(caught.value)
    assert path.read_bytes() == before


def test_the_command_line(path, sling) -> None:
    lab = path.parents[1]
    done = sling("setup", "--max-force=20", "--topic", "wrench=/ft", "--json", folder=lab)
    assert done.returncode == 0, done.stderr
    changed = json.loads(done.stdout)["changed"]
    assert changed["max_force"] == {"old": 30.0, "new": 20.0}
    assert changed["topics"] == {"old": {}, "new": {"wrench": "/ft"}}
    assert YAML(typ="safe").load(path.read_text())["setup"]["max_force"] == 20.0
    for arguments, words in (
        (("--left-tip", "-0.7,0.1,0.4"), "one that begins with - is joined by =: --left-tip=-..."),
        (("--topic", "force=/ft"), "must be ROLE=TOPIC, of wrench, pose"),
        (("--base-to-camera=1,2,3,0,0,0,2",), "its quaternion must have length 1, not 2"),
    ):
        done = sling("setup", *arguments, folder=lab)
        assert done.returncode in (1, 2) and words in done.stderr
        assert done.stderr.count("\n") == 1
