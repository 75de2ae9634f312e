"""What moves with the hand: its shape, learned where the band cannot be."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation

VOXEL, HALF = 0.008, 30  # m, and voxels from the middle to each side
REACH = VOXEL * HALF
OFTEN = 0.3  # share of the frames in which a part of the hand is seen
GAP = 4  # voxels, half the way of a finger
FEWEST = 4  # frames to learn from


class Shape:
    """Voxels around the tool centre point that the hand takes; it does not turn.

    Attributes:
        taken: Shape (2 HALF,) * 3, bool, axes of frame O.
    """

    def __init__(self, taken: np.ndarray):
        self.taken = taken

    @classmethod
    def learn(cls, clouds: Iterable[np.ndarray], often: float = OFTEN) -> Shape | None:
        """From clouds (S, 3), relative to the tool centre point, that do not show the band."""
        counts, frames = np.zeros((2 * HALF,) * 3, np.int32), 0
        for cloud in clouds:
            inside, cells = _cells(cloud)
            seen = np.zeros(counts.shape, bool)
            seen[tuple(cells[inside].T)] = True
            counts += seen
            frames += 1
        if frames < FEWEST or not counts.any():
            return None
        taken = counts >= max(2, often * frames)
        return cls(binary_dilation(taken, np.ones((3, 3, 3), bool)))

    @classmethod
    def swept(cls, first: Shape | None, last: Shape | None) -> Shape | None:
        """Both and what is between them: fingers on their way."""
        if first is None or last is None:
            return None
        between = binary_closing(np.pad(first.taken | last.taken, GAP), iterations=GAP)
        return cls(between[(slice(GAP, -GAP),) * 3])

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which points (S, 3), relative to the tool centre point, lie in the hand: (S,)."""
        inside, cells = _cells(points)
        found = np.zeros(len(points), bool)
        found[inside] = self.taken[tuple(cells[inside].T)]
        return found


def _cells(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each point (S, 3) lies in the grid, (S,), and its cell, (S, 3)."""
    cells = np.floor(points / VOXEL).astype(np.int64) + HALF
    return ((cells >= 0) & (cells < 2 * HALF)).all(axis=1), cells
