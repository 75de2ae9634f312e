"""Which of Foxglove's transforms are static."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sling2sim2real.recording.files import Container
from sling2sim2real.recording.topics import transforms_of
from tests.recording.messages import channel


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
