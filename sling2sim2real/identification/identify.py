"""A method of params.yaml, from episodes to parameters in memory.

The stages run the same functions one by one, each of which DVC caches.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluation
from sling2sim2real.identification.posterior.identify import Identified, fit_posterior
from sling2sim2real.identification.posterior.launches import Evidence
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.search import explore
from sling2sim2real.identification.searches.cma_es import refine
from sling2sim2real.identification.searches.regions import regions_of
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import POSTERIOR
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters


@dataclass(frozen=True)
class IdentifiedBand:
    """What a method makes of a band's episodes.

    Attributes:
        theta: θ*, one sample.
        evaluations: Everything that its search evaluated; None where it started from a point.
        density: Of a method that searches by least squares, else None.
    """

    theta: Parameters
    evaluations: Evaluations | None
    density: Identified | None


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
    regions, _ = regions_of(method_params, params.optimizer, on_free_axes)
    return explored.followed_by(refine(params, method, regions, evaluate))


def search_and_fit(
    params: Settings,
    method: str,
    sling: ClampedBand,
    episodes: Sequence[Episode],
    evaluate: Callable[[np.ndarray], Evaluation] | None = None,
    *,
    start: Parameters | None = None,
    evidence: Evidence | None = None,
    workers: int | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> IdentifiedBand:
    """Identify a band by a method: least squares takes all episodes, other searches the first.

    Args:
        sling: Of the band, with the method's law and clamps.
        evaluate: Losses of points of the whole unit cube, shape (N, D); a search needs it.
        start: One sample to fit the density from, without any search.
        evidence: Launches, of methods that search by least squares.
        workers: Threads of the fit; they change no result.
        progress: Called with a line after the exploration and at each step of the fit.

    Raises:
        UserError: All simulations fail.
    """
    evaluations = None
    if start is None:
        if evaluate is None:
            raise ValueError("either `evaluate` or `start` is needed")
        evaluations = evaluations_of(params, method, evaluate)
        progress(f"explored {len(evaluations.total)} points")
        start = evaluations.best_parameters(params.methods[method].law)
    if params.methods[method].search != POSTERIOR:
        return IdentifiedBand(start, evaluations, None)
    density = fit_posterior(
        params,
        method,
        sling,
        episodes,
        start,
        evidence=evidence,
        workers=workers,
        progress=lambda fit: progress(f"expansion {fit.steps}: misfit {fit.misfit:.2f}"),
    )
    return IdentifiedBand(density.mode, evaluations, density)
