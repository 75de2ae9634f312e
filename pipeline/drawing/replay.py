"""An episode as the calibrated simulator plays it, on the episode's own samples and stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.base.layout import Layout, NotMade
from pipeline.episode.episode import Episode
from pipeline.objective.loss import EpisodeLoss
from pipeline.sling.theta import calibrated, vector

LOAD = 1.5  # kg: the paper's dumbbell


@dataclass(frozen=True)
class Replay:
    """One simulated interaction.

    Attributes:
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
        center_line: Nodes of the band at the camera's stamps [m], shape (K, L, 3).
        distance: Of each frame's cloud from the simulated band [m], shape (K,); NaN without points.
        measured_work, work: Of the band on the hand since the start [J], shape (T,); forces and
            velocity through the loss's median filter, so that they end apart by its work term.
        residuals: "force" [N] and "cloud" [cm] during the pull, each "fitted" and "held_out".
        loaded: Nodes of the band at rest with `LOAD` at its middle [m], shape (L, 3), NaN where
            that was not found; no recording shows this.
    """

    force: np.ndarray
    center_line: np.ndarray
    distance: np.ndarray
    measured_work: np.ndarray
    work: np.ndarray
    residuals: dict[str, dict[str, float]]
    loaded: np.ndarray


def replay(params, band: str, method: str, episode: Episode, theta: dict) -> Replay:
    """Simulate the episode's interaction with a θ file's content.

    Raises:
        NotMade: θ fails in simulation.
    """
    from pipeline.sling.hang import hang
    from pipeline.sling.interaction import interact

    sling = calibrated(params, band, theta)
    loss = EpisodeLoss.of(params, method, episode, sling)
    rollouts = interact(sling, episode, vector(theta)[None])
    if rollouts.failure[0]:
        raise NotMade(Layout().theta(band, method), rollouts.failure[0])
    force = loss.filtered(rollouts)
    return Replay(
        force=force[0],
        center_line=rollouts.center_line[0],
        distance=loss.frames(rollouts)[0],
        measured_work=work(loss.force, loss.velocity, episode.sample_period),
        work=work(loss.smooth(force)[0], loss.velocity, episode.sample_period),
        residuals={
            kind: {part: float(value[0]) for part, value in parts.items()}
            for kind, parts in loss.residuals(rollouts).items()
        },
        loaded=hang(sling, vector(theta), LOAD)[0],
    )


def work(force: np.ndarray, velocity: np.ndarray, period: float) -> np.ndarray:
    """Work since the first sample by trapezoids [J], shape (T,), of (T, 3) at equal times."""
    power = np.einsum("tc,tc->t", force, velocity)
    return np.append(0.0, np.cumsum(power[1:] + power[:-1]) / 2 * period)
