"""Differential evolution: line 2 of the paper's algorithm 1, H <- DE(D_real, N_de)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sling2sim2real.identification.objective.box import latin_hypercube

if TYPE_CHECKING:
    from sling2sim2real.identification.search import Evaluate


def differential_evolution(
    evaluate: Evaluate,
    dimension: int,
    *,
    rollouts: int,
    seed: int,
    population: int,
    mutation: tuple[float, float] = (0.5, 1.0),
    recombination: float = 0.7,
) -> None:
    """SciPy's best/1/bin from a Latin hypercube; a generation is a batch, replaced at once.

    Args:
        mutation: Between which the factor of the differences is drawn, anew each generation.
        recombination: Probability by which a coordinate comes from the mutant.

    Raises:
        ValueError: SciPy refuses a setting.
    """
    from scipy import optimize

    first: Any = latin_hypercube(dimension, population, seed)  # SciPy's stubs know names alone
    optimize.differential_evolution(
        lambda generation: evaluate(generation.T),
        [(0.0, 1.0)] * dimension,
        init=first,
        rng=np.random.default_rng([seed, 1]),
        maxiter=-(-rollouts // population) - 1,
        mutation=mutation,
        recombination=recombination,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
        atol=-1,  # never met: every method spends its whole budget
    )
