"""How the hand of a recording drew the band: for how long, and how long it waited."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode

EDGES = 0.05, 0.95  # of the way; a cubic is there at these parts of its time:
PARTS = 0.1354, 0.8646
LEAST = 1e-3  # m


def launch_history(episode: Episode) -> dict[str, float]:
    """`pull_time` and `pause` [s] of the pull to the place of the release, and the `deepest` [m].

    As if the hand had gone there from the fork along a cubic in time, at rest at both ends: the one
    that passes 5 and 95 % of the way when the hand last did.
    Raises UserError where it lets go at the fork.
    """
    held = episode.time <= episode.release_time
    time, place = episode.time[held], episode.position[held]
    if not len(place) or np.linalg.norm(place[-1]) < LEAST:
        raise UserError(
            f"episode of {episode.band}: the hand lets go at the fork, so that no pull tells what"
            " the law rubber remembers; take neo_hookean, or a recording of a pull"
        )
    way = place @ place[-1] / (place[-1] @ place[-1])
    first, last = (max([*time[way < edge], time[0]]) for edge in EDGES)
    pull_time = np.clip((last - first) / (PARTS[1] - PARTS[0]), 0.01, 1000)
    pause = np.clip(episode.release_time - last - (1 - PARTS[1]) * pull_time, 0, 1e5)
    deepest = deepest_draw([episode])
    return {"pull_time": float(pull_time), "pause": float(pause), "deepest": deepest}


def deepest_draw(episodes: Iterable[Episode]) -> float:
    """How far from the fork hands held a band at most [m]."""
    held = [
        one.position[(one.time >= one.grasp_time) & (one.time <= one.release_time)]
        for one in episodes
    ]
    return float(np.linalg.norm(np.concatenate(held), axis=1).max())
