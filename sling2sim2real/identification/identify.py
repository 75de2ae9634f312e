"""A method's whole search in memory. Stages run its parts one by one, each of which DVC caches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.search import explore
from sling2sim2real.identification.searches.cma_es import refine
from sling2sim2real.identification.searches.regions import regions_of
from sling2sim2real.settings import Settings


def evaluations_of(
    params: Settings, method: str, evaluate: Callable[[np.ndarray], Evaluation]
) -> Evaluations:
    """Everything that the search of a method evaluates: exploration, then refinement if it has one.

    Args:
        evaluate: Losses of points of the whole unit cube, shape (N, D).
    """
    explored = explore(params, method, evaluate)
    method_params = params.methods[method]
    if method_params.search != "multistart":
        return explored
    free = SearchBox.of_method(params, method).free
    on_free_axes = Evaluations(method, free, [explored.table])
    regions = regions_of(method_params, params.optimizer, on_free_axes)
    return explored.followed_by(refine(params, method, regions, evaluate))
