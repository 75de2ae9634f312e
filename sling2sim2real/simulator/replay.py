"""A recorded pull as it is simulated: the force goes through the filter of the measured one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.signal import as_recorded, cutoff_hz
from sling2sim2real.settings.recording import ForceParams
from sling2sim2real.simulator.interaction import Rollouts, interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters


@dataclass(frozen=True)
class Replay:
    """N simulations of one pull, on the episode's clock, frame O.

    Attributes:
        rollouts: As simulated, with an unfiltered force.
        force: Of the band on the gripper at the episode's samples, filtered and averaged as the
            measured one [N], shape (N, T, 3).
    """

    rollouts: Rollouts
    force: np.ndarray


def replay(
    band: ClampedBand, episode: Episode, parameters: Parameters, force: ForceParams
) -> Replay:
    """Simulate an episode's pull with N parameters.

    `failure` of the rollouts says which count for nothing.

    Args:
        force: The filter of params.yaml.

    Raises:
        UserError: The episode has no pull.
    """
    rollouts = interact(band, episode, parameters)
    cutoff = cutoff_hz(force.cutoff, force.cutoff_unit)
    return Replay(rollouts, recorded_force(rollouts, episode, cutoff))


def recorded_force(rollouts: Rollouts, episode: Episode, cutoff: float) -> np.ndarray:
    """The force of N rollouts as the episode would have it [N], shape (N, T, 3).

    Args:
        cutoff: Of the low-pass that the measured force went through [Hz].
    """
    steps = np.moveaxis(np.asarray(rollouts.force, float), 0, 1)  # (S, N, 3)
    sampling = episode.time[0] - episode.sample_period / 2, episode.sample_period
    force = as_recorded(rollouts.times, steps, cutoff, *sampling, len(episode.time))
    return np.moveaxis(force, 1, 0)
