"""Expectations over a normal landing: of its distance from a target, and of the reward's shape.

A landing misses its target by `gap` in the mean, with standard deviation `spread`; arrays of equal
shape, in one unit. Without spread they are the plain distance and the plain shape.
"""

from __future__ import annotations

import numpy as np
from scipy.special import log_ndtr, ndtr

EXACT = 1e-12  # less of a spread is none


def distance(gap: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """E |X| of X ~ N(gap, spread²): the mean of the folded normal distribution."""
    gap, spread, ratio = _standardised(gap, spread)
    return spread * np.sqrt(2 / np.pi) * np.exp(-(ratio**2) / 2) + gap * (2 * ndtr(ratio) - 1)


def closeness(gap: np.ndarray, spread: np.ndarray, scale: float) -> np.ndarray:
    """E exp(-|X| / scale) of X ~ N(gap, spread²), between 0 and 1."""
    gap, spread, ratio = _standardised(np.asarray(gap) / scale, np.asarray(spread) / scale)
    if np.isinf(ratio).all():
        return np.exp(-gap)
    beyond = np.exp(spread**2 / 2 - gap + log_ndtr(ratio - spread))
    short = np.exp(spread**2 / 2 + gap + log_ndtr(-ratio - spread))
    return beyond + short


def _standardised(gap, spread) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """|gap|, spread, and their ratio, which is infinite where there is no spread."""
    gap, spread = np.broadcast_arrays(np.abs(np.asarray(gap, float)), np.asarray(spread, float))
    ratio = np.full(gap.shape, np.inf)
    return gap, spread, np.divide(gap, spread, out=ratio, where=spread > EXACT)
