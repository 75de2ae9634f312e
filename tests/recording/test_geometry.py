"""Frames that are joined, given, or missing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.base.errors import UserError
from pipeline.recording.geometry import geometry_of
from pipeline.recording.input.frames import Transform, TransformTree

SETUP = SimpleNamespace(base_to_fork=None, camera_to_fork=None, tip_link=None)
TURN = Rotation.from_euler("z", 30, degrees=True)
JOINED = {("fork", "base"): [0, -1, 0], ("base", "optical"): [1, 0, 0]}
ON_HAND = {("hand_tcp", "ft"): [0, 0, -0.1], ("flange", "hand_tcp"): [0, 0, 0.2]}


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


def test_a_sensor_on_the_hand() -> None:
    found = geometry_of(recording({**JOINED, **ON_HAND}), SETUP)
    assert not found.sensor_is_fixed and "hand_tcp" in found.sources["wrench"]
    np.testing.assert_allclose(found.sensor.apply([0, 0, 0.1]), [0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(found.camera.translation, [np.cos(np.pi / 6), -0.5, 0], atol=1e-12)


def test_a_depth_camera_of_its_own() -> None:
    apart = {**JOINED, **ON_HAND, ("optical", "depth_optical"): [-0.015, 0, 0]}
    found = geometry_of(recording(apart, depth="depth_optical"), SETUP)
    np.testing.assert_allclose(found.color.translation, [-0.015, 0, 0])
    registered = geometry_of(recording({**JOINED, **ON_HAND}), SETUP).camera
    np.testing.assert_allclose(found.camera.apply([0, 0, 1]), registered.apply([-0.015, 0, 1]))


def test_the_tip_link_is_the_frame_that_moves() -> None:
    """Where params name it, and the sensor sits on it, whatever else sounds like a tool."""
    joins = {**JOINED, **ON_HAND, ("ft", "pointed"): [0, 0, 0.2]}
    setup = SimpleNamespace(base_to_fork=None, camera_to_fork=None, tip_link="pointed")
    assert "ft on pointed" in geometry_of(recording(joins), setup).sources["wrench"]
    elsewhere = SimpleNamespace(base_to_fork=None, camera_to_fork=None, tip_link="optical")
    assert "ft on hand_tcp" in geometry_of(recording(joins), elsewhere).sources["wrench"]


def test_a_wrench_in_the_base() -> None:
    found = geometry_of(recording(JOINED, wrench="base"), SETUP)
    assert found.sensor_is_fixed
    np.testing.assert_allclose(found.sensor.rotation.as_matrix(), TURN.as_matrix())


def test_a_wrench_and_a_pose_without_frames_are_the_hands_and_the_bases() -> None:
    setup = SimpleNamespace(base_to_fork=(0, 1, 0, 0, 0, 0, 1), camera_to_fork=None, tip_link=None)
    found = geometry_of(recording({("fork", "optical"): [1, 0, 0]}, wrench="", pose=""), setup)
    assert not found.sensor_is_fixed
    assert found.sources["base_to_fork"] == "setup.base_to_fork"
    np.testing.assert_allclose(found.base.translation, [0, -1, 0])


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
