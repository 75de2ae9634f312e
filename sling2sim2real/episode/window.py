"""Which part of an interaction an episode holds: the paper's 9 s, or as long as it takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sling2sim2real.base.errors import UserError
from sling2sim2real.settings.recording import EpisodeParams

LEAD = 0.5  # s of the hanging band before the grasp, in a window that is longer than usual
ROUNDING = 1e-6  # samples


@dataclass(frozen=True)
class Window:
    """Equal samples from `start` on.

    Attributes:
        start, duration: [s].
        samples: So many.
    """

    start: float
    duration: float
    samples: int

    @property
    def period(self) -> float:
        return self.duration / self.samples


def window_of(
    episode_params: EpisodeParams, first: float, grasp: float, release: float, margin: float = 0.0
) -> Window:
    """Window of `episode.duration` where grasp, release and tail fit into it, else a longer one.

    The usual one has as much lead-in as the tail leaves room for; a longer one has LEAD of it, ends
    with the tail, and keeps the samples' period.

    Args:
        first: From which on everything was recorded [s].
        grasp, release: [s].
        margin: That the window has before the grasp at least [s].

    Raises:
        UserError: It would be longer than `episode.longest`, or the grasp was not recorded.
    """
    start = max(first, release + episode_params.tail - episode_params.duration)
    if start <= grasp - margin:
        return Window(start, episode_params.duration, episode_params.samples)
    if first > grasp - margin:
        raise UserError(
            f"the recording begins at {first:.2f} s, too late for the grasp at {grasp:.2f} s:"
            " record from before it on"
        )
    period, end = episode_params.duration / episode_params.samples, release + episode_params.tail
    most = int(episode_params.longest / period + ROUNDING)
    samples = min(math.ceil((end - max(first, grasp - LEAD)) / period - ROUNDING), most)
    start = max(first, end - samples * period)
    if start > grasp - margin:
        raise UserError(
            f"from grasp to release it takes {release - grasp:.2f} s, more than episode.longest"
            f" {episode_params.longest:g} s less episode.tail {episode_params.tail:g} s: pull"
            " faster, with fewer cycles or a shorter pause, or raise episode.longest in params.yaml"
        )
    return Window(start, samples * period, samples)
