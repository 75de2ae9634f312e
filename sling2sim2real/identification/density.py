"""What a fitted density leaves for a θ file: the loss of its mode, and its entries."""

from __future__ import annotations

from dataclasses import replace

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.posterior.identify import Identified, confidence, theta_entries
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import POSTERIOR
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import EXTRA


def evaluated_mode(
    params: Settings, method: str, sling: ClampedBand, episode: Episode, density: Identified
) -> Evaluations:
    """The mode's loss, one row of the phase `posterior`."""
    mode = density.mode.sample()
    box = SearchBox.of_method(params, method)
    box = replace(box, fixed={name: mode[name] for name in EXTRA})
    evaluate = Evaluator(episode, sling, EpisodeLoss.of(params, method, episode, sling), box)
    evaluations = Evaluations(method, box.names)
    evaluations.add(
        evaluate(box.unit_of(density.mode)), phase=POSTERIOR, generation=density.fit.steps
    )
    return evaluations


def entries_of(density: Identified, explored: Evaluations) -> dict:
    """The entries of the θ file that no table of evaluations holds."""
    return theta_entries(density) | {
        "confidence": confidence(density),
        "rollouts": len(explored.total) + density.rollouts,
    }
