"""The second search of a multistart: a CMA-ES in each region of its exploration."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.optimizers.cma.multistart import Multistart
from sling2sim2real.identification.search.evaluations import Evaluations
from sling2sim2real.identification.search.loop import search
from sling2sim2real.identification.search.regions import Region
from sling2sim2real.settings import Settings


def refine(
    params: Settings,
    method: str,
    regions: Sequence[Region],
    evaluate: Callable[[np.ndarray], Evaluation],
) -> Evaluations:
    """Everything that a CMA-ES in each region evaluates, `optimizer.cma_rollouts` in all.

    Args:
        regions: On the method's free axes.
        evaluate: Losses of points of the whole unit cube, shape (N, D).
    """
    optimizer, box = params.optimizer, SearchBox.of_method(params, method)
    evaluations = Evaluations(method, box.names)
    search(
        Multistart(list(regions), population=optimizer.cma_population, seed=optimizer.seed),
        evaluate,
        evaluations,
        rollouts=optimizer.cma_rollouts,
        box=box,
    )
    return evaluations
