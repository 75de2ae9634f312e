"""One CMA-ES in each region, all regions' candidates asked for as one batch.

The solver of a region searches z from N(0, I), and θ = mu + L z with L L' = Sigma, so that its
first samples follow the region's covariance. Points outside the box are reflected into it: the
evaluated point is what the evaluations record.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.identification.objective.box import reflect
from sling2sim2real.identification.search.regions import Region


class Multistart:
    """CMA-ES in every region side by side."""

    phase = "cma"

    def __init__(self, regions: list[Region], *, population: int, seed: int) -> None:
        """Start a solver in each region, with `population` candidates an iteration each."""
        seeds = np.random.SeedSequence(seed).generate_state(len(regions))
        self._solvers = [
            Solver(region, population, int(solver_seed))
            for region, solver_seed in zip(regions, seeds, strict=True)
        ]
        self.owner = np.repeat(np.arange(len(regions)), population)

    def ask(self) -> np.ndarray:
        """Candidates of all solvers, shape (regions * population, D); `owner` says whose."""
        return np.concatenate([solver.ask() for solver in self._solvers])

    def tell(self, losses: np.ndarray) -> None:
        """Their finite losses, shape (regions * population,)."""
        for number, solver in enumerate(self._solvers):
            solver.tell(losses[self.owner == number])


class Solver:
    """CMA-ES of one region, by ask and tell in the unit cube."""

    def __init__(self, region: Region, population: int, seed: int) -> None:
        import cma  # which imports Matplotlib: half a second that only a start needs

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
