"""What is learned of the hand: its shape, and its colours that are not the band's.

Hue and saturation count as colours, which shadows do not change.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation, gaussian_filter

VOXEL, HALF = 0.008, 30  # m, and voxels from the middle to each side
REACH = VOXEL * HALF
OFTEN = 0.3  # share of the frames in which a part of the hand is seen
GAP = 4  # voxels, half the way of a finger
FEWEST = 4  # frames to learn from
BINS = 48  # of each axis of chromaticity
ENOUGH = 200  # pixels to learn from, of the band and of the hand
TOLD_APART = 0.97  # balanced accuracy from which colours count
DARK = 90  # sum of the channels below which they tell nothing
AGAINST = 0.1  # share of the band in a bin up to which a pixel is the hand's


class Shape:
    """Voxels around the tool centre point that the hand takes; it does not turn.

    Attributes:
        taken: Shape (2 HALF,) * 3, bool, axes of frame O.
    """

    def __init__(self, taken: np.ndarray):
        self.taken = taken

    @classmethod
    def learn(cls, clouds: Iterable[np.ndarray], often: float = OFTEN) -> Shape | None:
        """Shape in clouds (S, 3), relative to the tool centre point, that do not show the band."""
        counts, frames = np.zeros((2 * HALF,) * 3, np.int32), 0
        for cloud in clouds:
            inside, cells = _voxels(cloud)
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
        """Shape of both and what is between them: fingers on their way."""
        if first is None or last is None:
            return None
        between = binary_closing(np.pad(first.taken | last.taken, GAP), iterations=GAP)
        return cls(between[(slice(GAP, -GAP),) * 3])

    def holds(self, points: np.ndarray) -> np.ndarray:
        """Which points (S, 3), relative to the tool centre point, lie in the hand: (S,)."""
        inside, cells = _voxels(points)
        within = np.zeros(len(points), bool)
        within[inside] = self.taken[tuple(cells[inside].T)]
        return within


def _voxels(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether each point (S, 3) lies in the grid, (S,), and its cell, (S, 3)."""
    cells = np.floor(points / VOXEL).astype(np.int64) + HALF
    return np.all((cells >= 0) & (cells < 2 * HALF), axis=1), cells


class Colors:
    """Which chromaticities are the hand's and not the band's.

    Attributes:
        share: Of the band in each bin, shape (BINS, BINS).
    """

    def __init__(self, share: np.ndarray):
        self.share = share

    @classmethod
    def learn(cls, band: np.ndarray, hand: np.ndarray) -> Colors | None:
        """Learn from BGR pixels (S, 3) of both; None where colours do not tell them apart."""
        samples = [pixels[_bright(pixels)] for pixels in (band, hand)]
        if min(map(len, samples)) < ENOUGH:
            return None
        counts = []
        for pixels in samples:
            histogram = np.zeros((BINS, BINS))
            np.add.at(histogram, _bins(pixels), 1.0)
            counts.append(gaussian_filter(histogram, 1.0, mode="nearest") / len(pixels) + 1e-6)
        share = counts[0] / (counts[0] + counts[1])
        right = [np.mean(share[_bins(pixels)] > 0.5) for pixels in samples]
        return cls(share) if (right[0] + 1 - right[1]) / 2 > TOLD_APART else None

    def against(self, pixels: np.ndarray) -> np.ndarray:
        """Which BGR pixels (S, 3) are the hand's rather than the band's: (S,)."""
        return _bright(pixels) & (self.share[_bins(pixels)] < AGAINST)


def _bright(pixels: np.ndarray) -> np.ndarray:
    return pixels.sum(axis=1, dtype=np.int32) > DARK


def _bins(pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of blue and green in a pixel (S, 3), as bins."""
    whole = np.maximum(pixels.sum(axis=1, dtype=np.int32), 1)
    cells = pixels[:, :2].astype(np.int32) * (BINS - 1) // whole[:, None]
    return cells[:, 0], cells[:, 1]
