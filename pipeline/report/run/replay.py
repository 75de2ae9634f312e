"""An episode as the calibrated simulator plays it, on the episode's own samples and stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.base.layout import Layout, NotMade
from pipeline.episode.episode import Episode
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.results.theta import calibrated, parameters_of


@dataclass(frozen=True)
class Replay:
    """One simulated interaction.

    Attributes:
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
        center_line: Nodes of the band at the camera's stamps [m], shape (K, L, 3).
        distance: Of each frame's cloud from the simulated band [m], shape (K,); NaN without points.
        residuals: "force" [N] and "cloud" [cm] during the pull, each "fitted" and "held_out".
    """

    force: np.ndarray
    center_line: np.ndarray
    distance: np.ndarray
    residuals: dict[str, dict[str, float]]


def replay(params, band: str, method: str, episode: Episode, theta: dict) -> Replay:
    """Simulate the episode's interaction with a θ file's content.

    Raises:
        NotMade: θ fails in simulation.
    """
    from pipeline.simulator.interaction import interact

    sling = calibrated(params, band, theta)
    loss = EpisodeLoss.of(params, method, episode, sling)
    rollouts = interact(sling, episode, parameters_of(theta))
    if rollouts.failure[0]:
        raise NotMade(Layout().theta(band, method), rollouts.failure[0])
    return Replay(
        force=loss.filtered(rollouts)[0],
        center_line=rollouts.center_line[0],
        distance=loss.frames(rollouts)[0],
        residuals={
            kind: {part: float(value[0]) for part, value in parts.items()}
            for kind, parts in loss.residuals(rollouts).items()
        },
    )
