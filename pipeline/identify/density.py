"""What a fitted density leaves for a θ file: the loss of its mode, and its entries."""

from __future__ import annotations

from dataclasses import replace

from pipeline.episode.episode import Episode
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.evaluate import Evaluator
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.posterior.identify import Identified, confidence, theta_entries
from pipeline.identify.search.evaluations import Evaluations
from pipeline.params import Params
from pipeline.params.identification import LEAST_SQUARES
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import EXTRA


def evaluated_mode(
    params: Params, method: str, sling: ClampedBand, episode: Episode, density: Identified
) -> Evaluations:
    """The mode's loss, one row of the phase `least_squares`."""
    mode = density.mode.sample()
    box = SearchBox.of_method(params, method)
    box = replace(box, fixed={name: mode[name] for name in EXTRA})
    evaluate = Evaluator(episode, sling, EpisodeLoss.of(params, method, episode, sling), box)
    evaluations = Evaluations(method, box.names)
    evaluations.add(
        evaluate(box.unit_of(density.mode)), phase=LEAST_SQUARES, generation=density.fit.steps
    )
    return evaluations


def entries_of(density: Identified, explored: Evaluations) -> dict:
    """The entries of the θ file that no table of evaluations holds."""
    return theta_entries(density) | {
        "confidence": confidence(density),
        "rollouts": len(explored.total) + density.rollouts,
    }
