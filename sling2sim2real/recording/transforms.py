"""Rigid transforms and the tree of /tf_static."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Transform:
    """Coordinates in one frame to coordinates in another: x -> R x + t."""

    rotation: Rotation
    translation: np.ndarray  # (3,) m

    @classmethod
    def of(cls, pose: Sequence[float] | np.ndarray) -> Transform:
        """Convert [x, y, z, qx, qy, qz, qw], the pose of the source frame in the target frame."""
        return cls(Rotation.from_quat(pose[3:]), np.asarray(pose[:3], float))

    @classmethod
    def identity(cls) -> Transform:
        return cls(Rotation.identity(), np.zeros(3))

    def pose(self) -> list[float]:
        """[x, y, z, qx, qy, qz, qw], as `of` takes it."""
        return [*self.translation.tolist(), *self.rotation.as_quat(canonical=True).tolist()]

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Points, shape (3,) or (N, 3), in their own precision."""
        points = np.asarray(points)
        kind = np.result_type(points, np.float32)
        matrix, offset = self.rotation.as_matrix().astype(kind), self.translation.astype(kind)
        return points @ matrix.T + offset

    def __matmul__(self, other: Transform) -> Transform:
        """First `other`, then this."""
        return Transform(self.rotation * other.rotation, self.apply(other.translation))

    def inverse(self) -> Transform:
        back = self.rotation.inv()
        return Transform(back, -back.apply(self.translation))


class TransformTree:
    """Static transforms between named frames; need not be one connected tree."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Transform]] = {}
        self.doubled: set[str] = set()  # frames that were published at two places

    @property
    def parents(self) -> dict[str, str]:
        """Each frame's parent."""
        return {child: parent for child, (parent, _) in self._parents.items()}

    def add(self, parent: str, child: str, pose: Transform) -> None:
        """`pose` maps coordinates in the child to coordinates in the parent."""
        self._parents[_bare(child)] = (_bare(parent), pose)

    @property
    def frames(self) -> list[str]:
        parents = [parent for parent, _ in self._parents.values()]
        return sorted({*self._parents, *parents})

    def is_root(self, frame: str) -> bool:
        return _bare(frame) not in self._parents

    def between(self, target: str, source: str) -> Transform | None:
        """Source coordinates to target coordinates; None where no chain joins the two."""
        up, down = self._to_root(_bare(source)), self._to_root(_bare(target))
        common = next((frame for frame in up if frame in down), None)
        if common is None:
            return None
        return down[common].inverse() @ up[common]

    def _to_root(self, frame: str) -> dict[str, Transform]:
        """Transforms from `frame` to itself and to each of its ancestors, by their names."""
        chain = {frame: Transform.identity()}
        while frame in self._parents:
            parent, pose = self._parents[frame]
            if parent in chain:
                break  # a loop, which no valid tree has
            chain[parent] = pose @ chain[frame]
            frame = parent
        return chain


def is_tool(frame: str) -> bool:
    """Whether a frame or link is named like the tool centre point: hand_tcp, ee_link."""
    return any(f"_{word}_" in f"_{frame.lower()}_" for word in ("tcp", "ee", "end_effector"))


def _bare(frame: str) -> str:
    return frame.lstrip("/")
