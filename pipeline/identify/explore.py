"""Differential evolution over the whole box: where are the promising regions?"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import differential_evolution
from scipy.stats import qmc

from pipeline.identify.evaluate import Evaluation, Penalty
from pipeline.identify.history import History


def explore(evaluate: Callable[[np.ndarray], Evaluation], optimizer, history: History) -> None:
    """Evaluate `population` agents, then move them `generations` times; all rows go to `history`.

    Args:
        evaluate: Losses of points of the unit cube, shape (N, D).
        optimizer: params.yaml's `optimizer`: seed, population, generations, mutation,
            recombination.
    """
    dimension = len(history.names)
    penalty = Penalty()
    generation = 0

    def objective(unit: np.ndarray) -> np.ndarray:
        nonlocal generation
        evaluation = evaluate(unit.T)
        history.add(evaluation, phase="de", generation=generation)
        generation += 1
        return penalty(evaluation.total)

    rng = np.random.default_rng(optimizer.seed)
    differential_evolution(
        objective,
        [(0.0, 1.0)] * dimension,
        # SciPy's own Latin hypercube only takes multiples of the dimension.
        init=qmc.LatinHypercube(dimension, rng=rng).random(optimizer.population),
        rng=rng,
        maxiter=optimizer.generations,
        mutation=optimizer.mutation,
        recombination=optimizer.recombination,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
        atol=-1.0,  # never met: every method spends its whole budget
    )
