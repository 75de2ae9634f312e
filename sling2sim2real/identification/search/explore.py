"""The first search of a method over the whole box of parameters; of most methods the only one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.search.build import explorer
from sling2sim2real.identification.search.evaluations import Evaluations
from sling2sim2real.identification.search.loop import search
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LEAST_SQUARES


def rollouts_of(params: Settings, method: str) -> int:
    """How many points a method explores.

    A search of one phase has the rollouts of a refinement too: all methods spend the same.
    """
    optimizer = params.optimizer
    count = optimizer.population * (optimizer.generations + 1)
    if params.methods[method].search in ("multistart", LEAST_SQUARES):
        return count
    return count + optimizer.cma_rollouts


def explore(
    params: Settings, method: str, evaluate: Callable[[np.ndarray], Evaluation]
) -> Evaluations:
    """Everything that the exploration of a method evaluates, in order.

    Args:
        evaluate: Losses of points of the whole unit cube, shape (N, D).

    Raises:
        UserError: As `search` and `explorer`.
    """
    method_params, box = params.methods[method], SearchBox.of_method(params, method)
    rollouts = rollouts_of(params, method)
    optimizer = explorer(method_params, params.optimizer, len(box.free), rollouts)
    evaluations = Evaluations(method, box.names)
    search(optimizer, evaluate, evaluations, rollouts=rollouts, box=box)
    return evaluations
