"""Samples of a density that is cheap to evaluate: the affine-invariant ensemble sampler.

Goodman and Weare 2010, stretch move, a = 2. It needs no tuning, whatever the correlations, and a
density that ends at the faces of a box is no trouble.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

STRETCH = 2.0


def sample(
    log_density: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    *,
    steps: int,
    keep: int,
    rng: np.random.Generator,
) -> np.ndarray:
    """Walkers of the last `keep` of `steps` steps, shape (keep, W, D).

    Args:
        log_density: Of points (N, D); -inf where there is none.
        start: Walkers (W, D), W even and several times D, each where the density is not 0.
    """
    walkers = np.array(start, float)
    count, dimension = walkers.shape
    value = log_density(walkers)
    kept = []
    for step in range(steps):
        order = rng.permutation(count)
        for mine, others in (
            (order[: count // 2], order[count // 2 :]),
            (order[count // 2 :], order[: count // 2]),
        ):
            stretch = ((STRETCH - 1) * rng.random(len(mine)) + 1) ** 2 / STRETCH
            partner = walkers[rng.choice(others, len(mine))]
            proposed = partner + stretch[:, None] * (walkers[mine] - partner)
            new = log_density(proposed)
            accept = np.log(rng.random(len(mine))) < (
                (dimension - 1) * np.log(stretch) + new - value[mine]
            )
            walkers[mine[accept]], value[mine[accept]] = proposed[accept], new[accept]
        if step >= steps - keep:
            kept.append(walkers.copy())
    return np.stack(kept)
