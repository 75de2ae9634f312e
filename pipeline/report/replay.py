"""An episode as the calibrated simulator plays it, on the episode's own samples and stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.episode import Episode
from pipeline.errors import UserError
from pipeline.signal import average, cutoff_hz, lowpass

RATE = 1000.0  # of the simulated force on its way through the filter [Hz]


@dataclass(frozen=True)
class Replay:
    """One simulated interaction.

    Attributes:
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
        center_line: Nodes of the band at the camera's stamps [m], shape (K, L, 3).
    """

    force: np.ndarray
    center_line: np.ndarray


def replay(params, band: str, episode: Episode, theta: np.ndarray) -> Replay:
    """Simulate the episode's interaction with physical θ, shape (5,).

    Raises:
        UserError: θ fails in simulation.
    """
    from pipeline.sling.interaction import interact
    from pipeline.sling.model import load_sling

    sling = load_sling(params, band)
    rollouts = interact(sling, episode, theta[None])
    if rollouts.failure[0]:
        raise UserError(f"theta of {band}: {rollouts.failure[0]}; `dvc repro theta` makes it anew")
    start = episode.time[0] - episode.sample_period / 2
    samples = len(episode.time)
    grid = start + np.arange(int(samples * episode.sample_period * RATE) + 1) / RATE
    # Until the grasp nothing pulls at the hand.
    force = [np.interp(grid, rollouts.times, axis, left=0.0) for axis in rollouts.force[0].T]
    cutoff = cutoff_hz(params.force.cutoff, params.force.cutoff_unit)
    smooth = lowpass(np.stack(force, axis=1), RATE, cutoff)
    return Replay(
        force=average(grid, smooth, start, episode.sample_period, samples),
        center_line=rollouts.center_line[0],
    )
