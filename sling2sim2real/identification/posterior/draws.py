"""Samples of a Gaussian within bounds, by Gibbs: each coordinate given the others, cut off."""

# Robert, Simulation of truncated normal variables (Statistics and Computing 5, 1995).

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

BURN, THIN = 50, 5  # sweeps
FAR = 8.0  # standard deviations, where a tail has no numbers left


def truncated_gaussian(
    centre: np.ndarray,
    precision: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    count: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Samples (count, D) of the density exp(-(x - centre)' precision (x - centre) / 2) in a box.

    Args:
        centre: Maximum of the unbounded Gaussian (D,), which may lie outside the box.
        precision: Positive definite, (D, D).
    """
    spread = 1 / np.sqrt(np.diag(precision))
    chains = np.tile(np.clip(centre, low, high), (count, 1))
    for _ in range(BURN * THIN):
        for axis, deviation in enumerate(spread):
            pull = (chains - centre) @ precision[axis] - precision[axis, axis] * (
                chains[:, axis] - centre[axis]
            )
            mean = centre[axis] - pull * deviation**2
            ends = [((end[axis] - mean) / deviation).clip(-FAR, FAR) for end in (low, high)]
            below, above = map(ndtr, ends)
            part = below + rng.random(count) * (above - below)
            tail = np.where(above > below, ndtri(np.clip(part, 1e-16, 1 - 1e-16)), ends[0])
            chains[:, axis] = np.clip(mean + deviation * tail, low[axis], high[axis])
    return chains
