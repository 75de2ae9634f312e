"""How the hand of a recording drew the band: for how long, and how long it waited."""

from __future__ import annotations

import numpy as np

from pipeline.episode.episode import Episode

EDGES = 0.05, 0.95  # of the way; a cubic is there at these parts of its time:
PARTS = 0.1354, 0.8646


def launch_history(episode: Episode) -> dict[str, float]:
    """`pull_time` and `pause` [s] of the pull to the place of the release.

    As if the hand had gone there from the fork along a cubic in time, at rest at both ends: the one
    that passes 5 and 95 % of the way when the hand last did.
    """
    held = episode.time <= episode.release_time
    time, place = episode.time[held], episode.position[held]
    way = place @ place[-1] / (place[-1] @ place[-1])
    first, last = (time[np.flatnonzero(way < edge)[-1:]].sum() for edge in EDGES)
    pull_time = max((last - first) / (PARTS[1] - PARTS[0]), 0.01)
    end = last + (1 - PARTS[1]) * pull_time
    return {"pull_time": float(pull_time), "pause": float(max(episode.release_time - end, 0.0))}
