"""Transforms against the textbook formula of quaternions; which of Foxglove's are static."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.recording.files import Container
from sling2sim2real.recording.topics import transforms_of
from sling2sim2real.recording.transforms import Transform, TransformTree
from tests.recording.messages import channel

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


def edge(parent: str, child: str, x: float, k: int) -> dict:
    return {
        "timestamp": {"sec": 5, "nsec": k},
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": {"x": x, "y": 0, "z": 0},
        "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
    }


def test_foxglove_transforms_that_keep_still_are_static() -> None:
    moving = [edge("base", "hand", 0.1 * k, k) for k in range(5)]
    still = [edge("base", "fork", 0.5, k) for k in range(5)]
    once = {"transforms": [edge("fork", "camera", 0.25, 0)]}
    many = channel("/tf", "foxglove.FrameTransform", [*moving, *still])
    batch = channel("/tf2", "foxglove.FrameTransforms", [once])
    tree = transforms_of(Container(Path("f.mcap"), [many, batch], []))
    np.testing.assert_allclose(tree.between("base", "camera").translation, [0.75, 0, 0])
    assert tree.between("base", "hand") is None
