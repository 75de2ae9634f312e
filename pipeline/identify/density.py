"""What a fitted density leaves for a θ file: the loss of its mode, and its entries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.episode.episode import Episode
from pipeline.identify.objective.evaluate import Evaluator
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.objective.space import Space
from pipeline.identify.posterior.identify import Identified, confidence, theta_entries
from pipeline.identify.search.history import History
from pipeline.params import Params
from pipeline.params.identification import LEAST_SQUARES
from pipeline.simulator.model import ClampedBand


def evaluated_mode(
    params: Params, method: str, sling: ClampedBand, episode: Episode, density: Identified
) -> History:
    """The mode's loss, one row of the phase `least_squares`."""
    entries, space = theta_entries(density), Space.of_method(params, method)
    at_mode = replace(
        sling,
        air_drag=entries["nuisances"]["air_drag"],
        turn_damping=entries["turn_damping"],
        returned_share=entries["returned_share"],
    )
    evaluate = Evaluator(episode, at_mode, EpisodeLoss.of(params, method, episode, at_mode), space)
    point = space.to_unit(np.array([[entries["theta"][name] for name in space.names]]))
    history = History(method, space.names)
    history.add(evaluate(point), phase=LEAST_SQUARES, generation=density.fit.steps)
    return history


def estimate_of(params: Params, density: Identified, explored: History) -> dict:
    """The entries of the θ file that no table of evaluations holds."""
    return theta_entries(density) | {
        "confidence": confidence(density, params.parameters),
        "rollouts": len(explored.total) + density.rollouts,
    }
