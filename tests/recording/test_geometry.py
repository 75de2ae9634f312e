"""Frames that are joined, given, or missing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.frames import geometry_of
from sling2sim2real.recording.transforms import Transform, TransformTree

SETUP = SimpleNamespace(base_to_fork=None, camera_to_fork=None, tip_link=None, fork_width=0.275)
TURN = Rotation.from_euler("z", 30, degrees=True)
JOINED = {("fork", "base"): [0, -1, 0], ("base", "optical"): [1, 0, 0]}
ON_HAND = {("hand_tcp", "ft"): [0, 0, -0.1], ("flange", "hand_tcp"): [0, 0, 0.2]}
POINTED = {**ON_HAND, ("ft", "pointed"): [0, 0, 0.2]}


def recording(joins: dict, wrench: str = "ft", pose: str = "base", depth: str = "optical"):
    tree = TransformTree()
    for (parent, child), place in joins.items():
        tree.add(parent, child, Transform(TURN, np.array(place, float)))
    color = SimpleNamespace(frame="optical")
    return SimpleNamespace(
        path="some.mcap",
        transforms=tree,
        pose=SimpleNamespace(frame=pose),
        wrench=SimpleNamespace(frame=wrench),
        color=color,
        depth=SimpleNamespace(frame=depth),
        color_camera=color,
        depth_camera=SimpleNamespace(frame=depth),
    )


@pytest.mark.parametrize(
    ("joins", "wrench", "tip", "source"),
    [
        (ON_HAND, "ft", None, "ft on hand_tcp"),
        (POINTED, "ft", "pointed", "ft on pointed"),  # whatever else sounds like a tool
        (POINTED, "ft", "optical", "ft on hand_tcp"),  # where the sensor does not sit
        ({}, "base", None, "fixed frame base"),
    ],
)
def test_where_the_sensor_sits(joins, wrench, tip, source) -> None:
    setup = SimpleNamespace(**(vars(SETUP) | {"tip_link": tip}))
    geometry = geometry_of(recording({**JOINED, **joins}, wrench=wrench), setup)
    assert source in geometry.sources["wrench"]
    assert geometry.sensor_is_fixed == (wrench == "base")
    if tip is None and joins:
        np.testing.assert_allclose(geometry.sensor.apply([0, 0, 0.1]), [0, 0, 0], atol=1e-12)
    if wrench == "base":
        np.testing.assert_allclose(geometry.sensor.rotation.as_matrix(), TURN.as_matrix())
    camera = [np.cos(np.pi / 6), -0.5, 0]
    np.testing.assert_allclose(geometry.camera.translation, camera, atol=1e-12)


def test_a_depth_camera_of_its_own() -> None:
    apart = {**JOINED, **ON_HAND, ("optical", "depth_optical"): [-0.015, 0, 0]}
    geometry = geometry_of(recording(apart, depth="depth_optical"), SETUP)
    np.testing.assert_allclose(geometry.color.translation, [-0.015, 0, 0])
    registered = geometry_of(recording({**JOINED, **ON_HAND}), SETUP).camera
    np.testing.assert_allclose(geometry.camera.apply([0, 0, 1]), registered.apply([-0.015, 0, 1]))


def test_a_wrench_and_a_pose_without_frames_are_the_hands_and_the_bases() -> None:
    setup = SimpleNamespace(base_to_fork=(0, 1, 0, 0, 0, 0, 1), camera_to_fork=None, tip_link=None)
    geometry = geometry_of(recording({("fork", "optical"): [1, 0, 0]}, wrench="", pose=""), setup)
    assert not geometry.sensor_is_fixed
    assert geometry.sources["base_to_fork"] == "setup.base_to_fork"
    np.testing.assert_allclose(geometry.base.translation, [0, -1, 0])


PLACES = st.lists(st.floats(-2, 2), min_size=3, max_size=3)
TURNS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(
    lambda quaternion: np.linalg.norm(quaternion) > 0.1
)
POSES = st.builds(
    lambda place, turn: (*place, *(np.array(turn) / np.linalg.norm(turn))), PLACES, TURNS
)


def matrix(pose: tuple) -> np.ndarray:
    """Homogeneous, written out."""
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return whole


def placed(edges: dict, **given):
    """The geometry with edges (parent, child): pose in /tf_static, and poses of `setup`."""
    bag = recording({})
    for edge, pose in edges.items():
        bag.transforms.add(*edge, Transform.of(pose))
    return geometry_of(bag, SimpleNamespace(**(vars(SETUP) | given)))


@given(fork=POSES, camera=POSES)
def test_any_two_of_base_camera_and_fork_give_the_third(fork, camera) -> None:
    """In params or in /tf_static, each way round; held against matrices and their inverses."""
    in_base, of_camera = matrix(fork), matrix(camera)  # of the fork, of the camera
    in_camera = np.linalg.inv(of_camera) @ in_base

    def pose(whole: np.ndarray) -> tuple:
        return (*whole[:3, 3], *Rotation.from_matrix(whole[:3, :3]).as_quat())

    base_camera, camera_base = (
        {("base", "optical"): camera},
        {("optical", "base"): pose(np.linalg.inv(of_camera))},
    )
    seen = pose(in_camera)
    for geometry in (
        placed(base_camera, base_to_fork=fork),
        placed(camera_base, base_to_fork=fork),
        placed(base_camera, camera_to_fork=seen),
        placed(camera_base | {("other", "fork"): (0, 0, 0, 0, 0, 0, 1)}, camera_to_fork=seen),
        placed({("base", "fork"): fork}, camera_to_fork=seen),
        placed({("optical", "fork"): seen}, base_to_fork=fork),
        placed({}, base_to_fork=fork, camera_to_fork=seen),
        placed(base_camera | {("base", "fork"): fork}),
        placed({("fork", "base"): pose(np.linalg.inv(in_base)), ("optical", "fork"): seen}),
    ):
        for transform, wanted in ((geometry.base, in_base), (geometry.camera, in_camera)):
            whole = np.eye(4)
            whole[:3, :3], whole[:3, 3] = transform.rotation.as_matrix(), transform.translation
            np.testing.assert_allclose(whole @ wanted, np.eye(4), atol=1e-9)
        assert geometry.loop is None
    whole = placed(base_camera, base_to_fork=fork, camera_to_fork=seen)
    assert whole.loop is not None and whole.loop.closed
    assert whole.loop.distance < 1e-6 and whole.loop.angle < 1e-6


def test_three_poses_that_contradict_each_other_say_by_how_much() -> None:
    """Setup comes first all the same; what measuring explains is no contradiction."""
    edges = {("base", "optical"): (0.7, -1.0, 0.4, 0, 0, 0, 1)}
    seen = (0.0, 1.0, 0.0, 0, 0, 0, 1)  # of the fork in the camera
    for off, turn, closed in ((0.012, 0.5, True), (0.05, 0.0, False), (0.0, 2.5, False)):
        turned = Rotation.from_euler("z", turn, degrees=True).as_quat()
        geometry = placed(edges, base_to_fork=(0.7 + off, 0, 0.4, *turned), camera_to_fork=seen)
        assert geometry.loop is not None and geometry.loop.closed is closed
        assert geometry.loop.distance == pytest.approx(off, abs=1e-12)
        assert f"lies {1e3 * off:.1f} mm and {turn:.2f} degrees off" in str(geometry.loop)
        assert geometry.sources["loop"] == str(geometry.loop)
        np.testing.assert_allclose(
            geometry.base.inverse().translation, (0.7 + off, 0, 0.4), atol=1e-12
        )


def test_a_base_without_a_name_is_not_joined_to_a_camera_without_one() -> None:
    bag = recording({}, pose="")
    bag.color.frame = ""
    with pytest.raises(UserError, match="messages name no frame"):
        geometry_of(bag, SimpleNamespace(**(vars(SETUP) | {"base_to_fork": FORK_AHEAD})))


FORK_AHEAD = (0.7, 0, 0.4, 0, 0, 0, 1)


@pytest.mark.parametrize(
    ("joins", "depth", "words"),
    [
        ({}, "optical", r"does not join 'base' to 'fork' \(it has nothing\).*base_to_fork"),
        ({("fork", "base"): [0, 0, 0]}, "optical", "'optical' to 'fork'.*camera_to_fork"),
        (JOINED, "elsewhere", "depth is in frame 'elsewhere', colour in 'optical'"),
    ],
)
def test_a_missing_frame_is_one_line(joins, depth, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        geometry_of(recording(joins, depth=depth), SETUP)
    assert str(caught.value).startswith("some.mcap: ") and "\n" not in str(caught.value)
