"""An episode as the calibrated simulator plays it, on the episode's own samples and stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.layout import Layout
from pipeline.params import Params
from pipeline.params.run import Pair
from sling2sim2real.base.layout import NotMade
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.theta import calibrated, parameters_of
from sling2sim2real.simulator.replay import replay


@dataclass(frozen=True)
class MethodReplay:
    """A pull as one method's θ plays it.

    Attributes:
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
        distance: Of each frame's cloud from the simulated band [m], shape (K,); NaN without points.
    """

    force: np.ndarray
    distance: np.ndarray


def replay_method(
    params: Params, pair: Pair, episode: Episode, theta: dict, layout: Layout
) -> MethodReplay:
    """Simulate the episode's pull with a θ file's content.

    Raises:
        NotMade: θ fails in simulation.
    """
    sling = calibrated(params, pair.band, theta, layout.clamps(pair))
    loss = EpisodeLoss.of(params, pair.method, episode, sling)
    done = replay(sling, episode, parameters_of(theta), params.force)
    if failure := done.rollouts.failure[0]:
        raise NotMade(layout.theta(pair), failure)
    return MethodReplay(done.force[0], loss.frames(done.rollouts)[0])
