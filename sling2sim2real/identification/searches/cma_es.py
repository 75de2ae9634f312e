"""CMA-ES in every region at once: stage 2, lines 6 to 15, of the paper's algorithm 1."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox, reflect
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.search import Evaluate, run
from sling2sim2real.identification.searches.regions import Region
from sling2sim2real.settings import Settings


def refine(
    params: Settings,
    method: str,
    regions: Sequence[Region],
    evaluate: Callable[[np.ndarray], Evaluation],
) -> Evaluations:
    """Everything that a CMA-ES in each region evaluates: the second search of a multistart.

    Args:
        regions: On the method's free axes.
        evaluate: Losses of points of the whole unit cube, shape (N, D).
    """
    optimizer, box = params.optimizer, SearchBox.of_method(params, method)
    evaluations = Evaluations(method, box.names)

    def search(losses_of: Evaluate) -> None:
        cma_es(losses_of, regions, population=optimizer.cma_population, seed=optimizer.seed)

    run(search, evaluate, evaluations, phase="cma", rollouts=optimizer.cma_rollouts, box=box)
    return evaluations


def cma_es(evaluate: Evaluate, regions: Sequence[Region], *, population: int, seed: int) -> None:
    """Search until the budget is spent, `population` candidates of each region a batch.

    Points outside the cube are reflected into it: the evaluated point is what is recorded.
    """
    seeds = np.random.SeedSequence(seed).generate_state(len(regions))
    factors = [np.linalg.cholesky(region.sigma) for region in regions]  # line 7
    strategies = [
        _solver(len(region.mu), population, int(own))  # line 8
        for region, own in zip(regions, seeds, strict=True)
    ]
    solver = np.repeat(np.arange(len(regions)), population)
    while True:
        asked = [strategy.ask() for strategy in strategies]  # line 11
        candidates = [
            reflect(region.mu + np.stack(z) @ factor.T)  # line 12
            for region, factor, z in zip(regions, factors, asked, strict=True)
        ]
        losses = evaluate(np.concatenate(candidates), solver)  # line 13
        for strategy, z, own in zip(strategies, asked, np.split(losses, len(regions)), strict=True):
            strategy.tell(z, own.tolist())  # line 14


def _solver(dimension: int, population: int, seed: int):
    """pycma's strategy, which samples z from N(0, I)."""
    import cma  # which imports Matplotlib: half a second that only a start needs

    rng = np.random.default_rng(seed)  # of its own, else solvers share NumPy's global one
    options = {
        "popsize": population,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,  # pycma's word for: leave NumPy's global generator alone
        "verbose": -9,
        "verb_disp": 0,
        "verb_log": 0,
    }
    return cma.CMAEvolutionStrategy(np.zeros(dimension), 1.0, options)
