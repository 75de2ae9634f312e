"""How the hand of a recording drew the band: for how long, and how long it waited."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.phases import turns

EDGES = 0.05, 0.95  # of the way; a cubic is there at these parts of its time:
PARTS = 0.1354, 0.8646
LEAST = 1e-3  # m


def launch_history(episode: Episode) -> dict[str, float]:
    """`pull_time` and `pause` [s] of the pull to the place of the release, and the `deepest` [m].

    As if the hand had gone there from the fork along a cubic in time, at rest at both ends: the one
    that passes 5 and 95 % of the way when the hand did. Of several full pulls the last one counts,
    without the time of dips on its way; the pause is since the hand last came to where it lets go.
    Raises UserError where it lets go at the fork.
    """
    held = episode.time <= episode.release_time
    time, place = episode.time[held], episode.position[held]
    if not len(place) or np.linalg.norm(place[-1]) < LEAST:
        raise UserError(
            f"episode of {episode.band}: the hand lets go at the fork, so that no pull tells what"
            " the law rubber remembers; take neo_hookean, or a recording of a pull"
        )
    deepest = deepest_draw([episode])
    way = place @ place[-1] / (place[-1] @ place[-1])
    first = float(max([*time[way < EDGES[0]], time[0]]))
    since = time > first
    time, way = time[since], way[since]
    bends = turns(way * np.linalg.norm(place[-1]))
    begin = bends[-2] if len(bends) > 2 else 0  # of the last way, from the fork or from a dip
    low, start = (way[begin], time[begin]) if begin else (0.0, first)
    part = (way[begin:] - low) / (1 - low)
    early, late = (max([*time[begin:][part < edge], start]) for edge in EDGES)
    last = np.clip((late - early) / (PARTS[1] - PARTS[0]), 0.01, 1000)
    pause = np.clip(episode.release_time - late - (1 - PARTS[1]) * last, 0, 1e5)
    whole = _from_fork(first, time, way, bends) if begin else last
    return {"pull_time": float(whole), "pause": float(pause), "deepest": deepest}


def _from_fork(first: float, time: np.ndarray, way: np.ndarray, bends: list[int]) -> float:
    """Time that a cubic takes for the way (T,) from the fork, which is left at `first` [s]."""
    arrived = int(np.argmax(way >= EDGES[1]))
    lost, until = 0.0, 0
    for top, low in zip(bends[1::2], bends[2::2], strict=False):
        again = low + int(np.argmax(way[low:] >= way[top]))
        if until <= top < arrived:
            until = min(again, arrived) if again > low else arrived
            lost += time[until] - time[top]
    late = time[arrived - 1] if arrived else first
    return float(np.clip((late - first - lost) / (PARTS[1] - PARTS[0]), 0.01, 1000))


def deepest_draw(episodes: Iterable[Episode]) -> float:
    """How far from the fork hands held a band at most [m]."""
    return float(np.linalg.norm(held_positions(episodes), axis=1).max())


def held_positions(episodes: Iterable[Episode]) -> np.ndarray:
    """Positions of the hands while they held a band, shape (N, 3)."""
    return np.concatenate(
        [e.position[(e.time >= e.grasp_time) & (e.time <= e.release_time)] for e in episodes]
    )
