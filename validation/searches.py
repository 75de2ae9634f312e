"""Plain variants of the searches in identification/search, without what strengthens those.

Each is a class for `search: package.module:Class` of a method in params.yaml.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.identification.optimizers.bo.bayes import Bayes
from sling2sim2real.identification.optimizers.cma.multistart import Multistart
from sling2sim2real.identification.optimizers.de.evolution import Evolution
from sling2sim2real.identification.search.loop import latin_hypercube
from sling2sim2real.identification.search.regions import Region, suppress


class PlainStarts:
    """Differential evolution, then a CMA-ES in each region, as `multistart`.

    But each starts as a ball of the usual size, of which the exploration says nothing: identity
    covariance, and a standard deviation of a quarter of the box (Hansen, The CMA Evolution
    Strategy: A Tutorial, arXiv:1604.00772).
    """

    def __init__(
        self,
        dimension: int,
        *,
        rollouts: int,
        seed: int,
        population: int,
        generations: int,
        k_top: int,
        delta: float,
        cma_population: int,
        mutation_low: float = 0.5,
        mutation_high: float = 1.0,
        recombination: float = 0.7,
        deviation: float = 0.25,
    ) -> None:
        """Settings as params.yaml's `optimizer` has them; the deviation in edges of the cube."""
        explore = population * (generations + 1)
        self._stage = Evolution(
            dimension,
            rollouts=explore,
            seed=seed,
            population=population,
            mutation=(mutation_low, mutation_high),
            recombination=recombination,
        )
        self._left, self._seed, self._k_top, self._delta = explore, seed, k_top, delta
        self._population, self._sigma = cma_population, deviation**2 * np.eye(dimension)
        self._points: list[np.ndarray] = []
        self._losses: list[np.ndarray] = []

    @property
    def phase(self) -> str:
        return self._stage.phase

    @property
    def owner(self) -> np.ndarray | None:
        return getattr(self._stage, "owner", None)

    def ask(self) -> np.ndarray:
        self._asked = self._stage.ask()
        return self._asked

    def tell(self, losses: np.ndarray) -> None:
        if self._left <= 0:
            self._stage.tell(losses)
            return
        self._points.append(self._asked)
        self._losses.append(losses)
        self._left -= len(losses)
        if self._left > 0:
            self._stage.tell(losses)
            return
        unit, total = np.concatenate(self._points), np.concatenate(self._losses)
        rows = suppress(unit, total, self._delta, self._k_top)
        regions = [Region(unit[row], self._sigma, float(total[row]), [row]) for row in rows]
        self._stage = Multistart(regions, population=self._population, seed=self._seed)


class SmallBatches(Bayes):
    """Bayesian optimisation in small batches, whose model sees every point."""

    def __init__(
        self, dimension: int, *, rollouts: int, seed: int, population: int, batch: int = 4
    ) -> None:
        """A Latin hypercube of `population`, then `batch` points a round."""
        points = max(rollouts, 2)
        super().__init__(
            dimension, rollouts=rollouts, seed=seed, population=population, points=points
        )
        self._population = batch  # of the rounds; the hypercube is drawn


class PlainAdam:
    """Adam by forward differences from one random point, with one rate.

    No gradient is cut, and a failed point counts as the loop tells it.
    """

    phase = "adam"

    def __init__(
        self,
        dimension: int,
        *,
        rollouts: int,
        seed: int,
        population: int,
        rate: float = 0.05,
        step: float = 0.003,
    ) -> None:
        """Rate and step in edges of the cube; `rollouts` and `population` are not used."""
        import torch

        self._x = torch.tensor(latin_hypercube(dimension, 1, seed)[0], requires_grad=True)
        self._adam, self._step = torch.optim.Adam([self._x], lr=rate), step

    def ask(self) -> np.ndarray:
        """The point and its differences, shape (D + 1, D)."""
        at = self._x.detach().numpy()
        self._moved = np.where(at + self._step <= 1, self._step, -self._step)
        return np.vstack([at, at + np.diag(self._moved)])

    def tell(self, losses: np.ndarray) -> None:
        import torch

        self._x.grad = torch.from_numpy((losses[1:] - losses[0]) / self._moved)
        self._adam.step()
        self._x.data.clamp_(0, 1)
