"""Sudden changes of a force: the difference of means over two windows, and the samples' noise.

In change-point detection the difference is known as the MOSUM statistic (moving sums). It peaks
where a step is, by the size of that step.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.base.errors import UserError

NEAR, FAR = 0.005, 0.05  # s from a sample to the windows' near ends, and to their far ends


def reach(t: np.ndarray) -> tuple[int, int]:
    """NEAR and FAR in samples. Raises UserError for less than four times FAR of force."""
    period = float(np.median(np.diff(t)))
    near, far = max(1, round(NEAR / period)), max(3, round(FAR / period))
    if len(t) < 4 * far:
        raise UserError("the force is too short to find a release in it")
    return near, far


def means(x: np.ndarray, near: int, far: int) -> tuple[np.ndarray, np.ndarray]:
    """Means over [-far, -near] and over [near, far] samples around each sample, two (S, 3)."""
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(x, axis=0)])
    middle, last = np.arange(len(x)), len(x)

    def mean(first: int, end: int) -> np.ndarray:
        a, b = np.clip(middle + first, 0, last), np.clip(middle + end + 1, 0, last)
        return (sums[b] - sums[a]) / np.maximum(b - a, 1)[:, None]

    return mean(-far, -near), mean(near, far)


def sample_noise(x: np.ndarray) -> float:
    """Standard deviation of single samples (S, ...) about what changes slowly: the largest.

    By the median absolute deviation (MAD) of first differences, which a few steps do not move.
    """
    change = np.diff(x, axis=0)
    spread = np.median(np.abs(change - np.median(change, axis=0)), axis=0)
    return float(np.max(1.4826 * spread / np.sqrt(2)))
