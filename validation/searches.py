"""Plain variants of the searches in identification/searches, without what strengthens those.

Each is a function for `search: package.module:function` of a method in params.yaml.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from sling2sim2real.identification.objective.box import latin_hypercube
from sling2sim2real.identification.search import Evaluate
from sling2sim2real.identification.searches.bo import bayesian
from sling2sim2real.identification.searches.cma_es import cma_es
from sling2sim2real.identification.searches.de import differential_evolution
from sling2sim2real.identification.searches.regions import Region, suppress


def plain_starts(
    evaluate: Evaluate,
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
    """Differential evolution, then a CMA-ES in each region, as `multistart`.

    But each starts as a ball of the usual size, of which the exploration says nothing: identity
    covariance, and a standard deviation of a quarter of the box (Hansen, The CMA Evolution
    Strategy: A Tutorial, arXiv:1604.00772).

    Settings are as params.yaml's `optimizer` has them; the deviation in edges of the cube.
    """
    batches: list[tuple[np.ndarray, np.ndarray]] = []

    def kept(unit: np.ndarray, solver: np.ndarray | None = None) -> np.ndarray:
        batches.append((unit, evaluate(unit, solver)))
        return batches[-1][1]

    differential_evolution(
        kept,
        dimension,
        rollouts=population * (generations + 1),
        seed=seed,
        population=population,
        mutation=(mutation_low, mutation_high),
        recombination=recombination,
    )
    unit, total = (np.concatenate(parts) for parts in zip(*batches, strict=True))
    sigma = deviation**2 * np.eye(dimension)
    rows = suppress(unit, total, delta, k_top)
    regions = [Region(unit[row], sigma, float(total[row]), [row]) for row in rows]
    cma_es(evaluate, regions, population=cma_population, seed=seed)


small_batches = partial(bayesian, points=1_000_000, batch=4)  # whose model sees every point


def plain_adam(
    evaluate: Evaluate,
    dimension: int,
    *,
    rollouts: int,
    seed: int,
    population: int,
    rate: float = 0.05,
    step: float = 0.003,
) -> None:
    """Adam by forward differences from one random point, with one rate, in edges of the cube.

    No gradient is cut, and a failed point counts as it is told. `rollouts` and `population` are not
    used.
    """
    import torch

    x = torch.tensor(latin_hypercube(dimension, 1, seed)[0], requires_grad=True)
    optimizer = torch.optim.Adam([x], lr=rate)
    while True:
        at = x.detach().numpy()
        moved = np.where(at + step <= 1, step, -step)
        losses = evaluate(np.vstack([at, at + np.diag(moved)]))
        x.grad = torch.from_numpy((losses[1:] - losses[0]) / moved)
        optimizer.step()
        x.data.clamp_(0, 1)
