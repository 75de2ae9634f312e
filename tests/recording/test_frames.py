"""Transforms against the textbook formula of quaternions."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.recording.transforms import Transform, TransformTree

number = st.floats(-5, 5)
vectors = st.tuples(number, number, number)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: 0.1 < np.linalg.norm(q))
poses = st.tuples(vectors, quaternions).map(
    lambda pair: (*pair[0], *(np.array(pair[1]) / np.linalg.norm(pair[1])))
)


def moved(pose: tuple, point: np.ndarray) -> np.ndarray:
    """Rotate by the quaternion (u, w): v + 2 w (u x v) + 2 u x (u x v), then shift."""
    u, w = np.array(pose[3:6]), pose[6]
    twice = 2 * np.cross(u, point)
    return point + w * twice + np.cross(u, twice) + pose[:3]


@given(poses, vectors)
def test_a_pose_moves_points(pose, point) -> None:
    np.testing.assert_allclose(Transform.of(pose).apply(point), moved(pose, point), atol=1e-9)


@given(poses, poses, poses, vectors)
def test_the_tree_joins_cousins(a, b, c, point) -> None:
    tree = TransformTree()
    tree.add("root", "arm", Transform.of(a))
    tree.add("arm", "hand", Transform.of(b))
    tree.add("/root", "camera", Transform.of(c))
    in_root = moved(a, moved(b, np.array(point)))
    in_camera = tree.between("camera", "hand").apply(point)
    np.testing.assert_allclose(moved(c, in_camera), in_root, atol=1e-7)


def test_frames_that_nothing_joins() -> None:
    tree = TransformTree()
    pose = Transform.of([0, 0, 1, 0, 0, 0, 1])
    tree.add("root", "arm", pose)
    tree.add("tool", "sensor", pose)
    assert tree.between("root", "sensor") is None
    assert tree.frames == ["arm", "root", "sensor", "tool"]
    assert tree.is_root("tool") and not tree.is_root("sensor")


def test_a_loop_ends() -> None:
    tree = TransformTree()
    pose = Transform.of([0, 0, 1, 0, 0, 0, 1])
    tree.add("a", "b", pose)
    tree.add("b", "a", pose)
    assert tree.between("c", "a") is None
