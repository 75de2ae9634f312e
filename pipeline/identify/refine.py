"""One CMA-ES in each region, all regions' candidates evaluated as one batch.

The solver of a region searches z from N(0, I), and θ = mu + L z with L L' = Sigma, so that its
first samples follow the region's covariance. Points outside the box are reflected into it: the
evaluated point is what the history records.
"""

from __future__ import annotations

from collections.abc import Callable

import cma
import numpy as np

from pipeline.identify.evaluate import Evaluation, Penalty
from pipeline.identify.history import History
from pipeline.identify.regions import Region
from pipeline.identify.space import reflect


class Solver:
    """CMA-ES of one region, asked and told in the unit cube."""

    def __init__(self, region: Region, population: int, seed: int) -> None:
        self._mu, self._factor = region.mu, np.linalg.cholesky(region.sigma)
        rng = np.random.default_rng(seed)  # of its own, else solvers share NumPy's global one
        self._cma = cma.CMAEvolutionStrategy(
            np.zeros(len(region.mu)),
            1.0,
            {
                "popsize": population,
                "randn": lambda *shape: rng.standard_normal(shape),
                "seed": np.nan,  # pycma's word for: leave NumPy's global generator alone
                "verbose": -9,
                "verb_disp": 0,
                "verb_log": 0,
            },
        )
        self._asked: list[np.ndarray] = []

    def ask(self) -> np.ndarray:
        """Candidates, shape (population, D)."""
        self._asked = self._cma.ask()
        return reflect(self._mu + np.stack(self._asked) @ self._factor.T)

    def tell(self, losses: np.ndarray) -> None:
        """Finite losses of the candidates that were asked for last, shape (population,)."""
        self._cma.tell(self._asked, losses.tolist())


def iterations(optimizer, solvers: int) -> int:
    """How often `solvers` can ask within the budget of rollouts."""
    return max(optimizer.cma_rollouts // (solvers * optimizer.cma_population), 1)


def refine(
    evaluate: Callable[[np.ndarray], Evaluation],
    regions: list[Region],
    optimizer,
    history: History,
) -> None:
    """Run a CMA-ES in every region side by side; all rows go to `history`.

    Args:
        evaluate: Losses of points of the unit cube, shape (N, D).
        optimizer: params.yaml's `optimizer`: seed, cma_population, cma_rollouts.
    """
    seeds = np.random.SeedSequence(optimizer.seed).generate_state(len(regions))
    solvers = [
        Solver(region, optimizer.cma_population, int(seed))
        for region, seed in zip(regions, seeds, strict=True)
    ]
    owner = np.repeat(np.arange(len(solvers)), optimizer.cma_population)
    penalty = Penalty()
    for iteration in range(iterations(optimizer, len(solvers))):
        evaluation = evaluate(np.concatenate([solver.ask() for solver in solvers]))
        history.add(evaluation, phase="cma", generation=iteration, solver=owner)
        losses = penalty(evaluation.total)
        for number, solver in enumerate(solvers):
            solver.tell(losses[owner == number])
