"""Differential evolution, which is SciPy's, behind ask and tell.

SciPy calls an objective and neither asks nor stops between two generations. So it runs in a thread
of its own, whose objective hands over each generation and waits for its losses. The two
never run at once.
"""

from __future__ import annotations

import weakref
from queue import SimpleQueue
from threading import Thread

import numpy as np
from scipy.optimize import differential_evolution

from sling2sim2real.identification.search.loop import latin_hypercube


class Evolution:
    """A generation is a batch; the first one is a Latin hypercube."""

    phase = "de"

    def __init__(
        self,
        dimension: int,
        *,
        rollouts: int,
        seed: int,
        population: int,
        mutation: tuple[float, float] = (0.5, 1.0),
        recombination: float = 0.7,
    ) -> None:
        """Start it: best/1/bin, the whole generation replaced at once, no stop before its budget.

        Args:
            mutation: Between which the factor of the differences is drawn, anew each generation.
            recombination: Probability by which a coordinate comes from the mutant.

        Raises:
            ValueError: A factor is not within 0 to 2, or the probability not within 0 to 1.
        """
        factors = np.array(mutation, float)
        if not (((factors >= 0) & (factors < 2)).all() and 0 <= recombination <= 1):
            raise ValueError(
                f"mutation must be from 0 to below 2 and recombination from 0 to 1,"
                f" got {mutation} and {recombination}"
            )
        self._asked, self._told = SimpleQueue(), SimpleQueue()
        options = {
            "init": latin_hypercube(dimension, population, seed),
            "rng": np.random.default_rng([seed, 1]),
            "maxiter": -(-rollouts // population),
            "mutation": mutation,
            "recombination": recombination,
        }
        arguments = (dimension, options, self._asked, self._told)
        Thread(target=_run, args=arguments, name="differential evolution", daemon=True).start()
        weakref.finalize(self, self._told.put, None)  # the thread knows the queues alone, and ends

    def ask(self) -> np.ndarray:
        """A generation's trial points, shape (population, D). Raises what SciPy raises."""
        generation = self._asked.get()
        if isinstance(generation, BaseException):
            raise generation
        return generation

    def tell(self, losses: np.ndarray) -> None:
        """Finite losses of the points that were asked for last, shape (population,)."""
        self._told.put(np.asarray(losses, float))


class _Dropped(Exception):
    """Nobody holds the optimiser any more."""


def _run(dimension: int, options: dict, points: SimpleQueue, answers: SimpleQueue) -> None:
    def objective(unit: np.ndarray) -> np.ndarray:
        points.put(np.ascontiguousarray(unit.T))
        losses = answers.get()
        if losses is None:
            raise _Dropped
        return losses

    try:
        differential_evolution(
            objective,
            [(0.0, 1.0)] * dimension,
            **options,
            vectorized=True,
            updating="deferred",
            polish=False,
            tol=0.0,
            atol=-1,  # never met: every method spends its whole budget
        )
        points.put(RuntimeError("differential evolution was asked beyond its budget"))
    except _Dropped:
        pass
    except BaseException as error:
        points.put(error)
