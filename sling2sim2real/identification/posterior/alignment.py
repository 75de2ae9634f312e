"""Where on the camera's clock the recoil is seen, before a fit that only finds what is near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.posterior.residuals import Rule, nearest
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

SEARCHED_TOLERANCES = 2.5  # tolerances of the camera's clock that are looked through
SHIFT_STEP_S = 0.001  # s
FOUND_BY_THE_FIT_S = 0.004  # s: a fit finds by itself what is as near
RECOIL_WINDOW_S = 0.09  # s from the release: pictures that are looked at
CLEAR_GAIN_M = 0.001  # m nearer to the points of the pictures, or nothing is moved
FARTHEST_M = 0.03  # m: as far off as it counts
MOST_POINTS_SEEN = 120
LEAST_POINTS_SEEN = 40
# Of the draw by which the band is behind the fork in a picture that tells.
LEAST_SHARE_OF_DRAW = 0.3


def recoil_seen(
    episode: Episode, tolerance: float, parameters: Parameters, sling: ClampedBand
) -> float | None:
    """What to add to the camera's stamps for the pictures around the release to show that band [s].

    None where the stamps are about right, or no shift is clearly better.

    Args:
        tolerance: Standard deviation of the camera's clock against the release [s].
        parameters: One sample, about right.
    """
    reach = SEARCHED_TOLERANCES * tolerance
    if reach <= FOUND_BY_THE_FIT_S:
        return None
    since = episode.cloud_time - episode.release_time
    hand = episode.position[episode.time <= episode.release_time][-1:]
    drawn = LEAST_SHARE_OF_DRAW * Rule.behind_fork(hand)
    near = [
        k
        for k in np.flatnonzero(np.abs(since) < RECOIL_WINDOW_S)
        if shows(episode.clouds[k], drawn)
    ]
    if not near:
        return None
    shifts = (
        np.arange(-np.floor(reach / SHIFT_STEP_S), np.floor(reach / SHIFT_STEP_S) + 1)
        * SHIFT_STEP_S
    )
    wanted = np.unique(np.round((since[near][:, None] + shifts) / SHIFT_STEP_S).astype(int))
    stamps = episode.release_time + wanted * SHIFT_STEP_S
    seen = replace(episode, cloud_time=stamps)
    played = interact(sling, seen, parameters, until=float(stamps[-1]))
    if played.failure[0]:
        return None
    lines = dict(zip(wanted.tolist(), played.center_line[0], strict=True))
    cost = np.zeros(len(shifts))
    for k in near:
        cloud = episode.clouds[k]
        points = np.asarray(cloud[:: -(-len(cloud) // MOST_POINTS_SEEN)], float)
        at = np.round((since[k] + shifts) / SHIFT_STEP_S).astype(int)
        cost += [_off(points, lines[i]) for i in at.tolist()]
    best = int(np.argmin(cost))
    here = cost[np.argmin(np.abs(shifts))]
    if abs(shifts[best]) <= FOUND_BY_THE_FIT_S or cost[best] > here - CLEAR_GAIN_M:
        return None
    return float(shifts[best])


def shows(cloud: np.ndarray, distance: float) -> bool:
    """Whether a cloud (P, 3) shows the band, and so far behind the fork [m]."""
    return len(cloud) > LEAST_POINTS_SEEN and Rule.behind_fork(cloud) > distance


def _off(points: np.ndarray, line: np.ndarray) -> float:
    """Mean distance of points (P, 3) from a line (L, 3), each at most FARTHEST_M [m]."""
    foot, _, _ = nearest(points, line)
    return float(np.minimum(np.linalg.norm(points - foot, axis=1), FARTHEST_M).mean())
