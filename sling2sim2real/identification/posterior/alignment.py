"""Where on the camera's clock the recoil is seen, before a fit that only finds what is near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.posterior.residuals import Rule, nearest
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

REACH = 2.5  # tolerances of the camera's clock that are looked through
STEP = 0.001  # s
NEAR = 0.004  # s: a fit finds by itself what is as near
AROUND = 0.09  # s from the release: pictures that are looked at
CLEARLY = 0.001  # m nearer to the points of the pictures, or nothing is moved
FAR = 0.03  # m: as far off as it counts
MOST_POINTS = 120
LEAST_POINTS = 40
WAY = 0.3  # of the draw by which the band is behind the fork in a picture that tells


def recoil_seen(
    episode: Episode, tolerance: float, parameters: Parameters, sling: ClampedBand
) -> float | None:
    """What to add to the camera's stamps for the pictures around the release to show that band [s].

    None where the stamps are about right, or no shift is clearly better.

    Args:
        tolerance: Standard deviation of the camera's clock against the release [s].
        parameters: One sample, about right.
    """
    reach = REACH * tolerance
    if reach <= NEAR:
        return None
    since = episode.cloud_time - episode.release_time
    hand = episode.position[episode.time <= episode.release_time][-1:]
    drawn = WAY * Rule.behind(hand)
    near = [k for k in np.flatnonzero(np.abs(since) < AROUND) if shows(episode.clouds[k], drawn)]
    if not near:
        return None
    shifts = np.arange(-np.floor(reach / STEP), np.floor(reach / STEP) + 1) * STEP
    wanted = np.unique(np.round((since[near][:, None] + shifts) / STEP).astype(int))
    stamps = episode.release_time + wanted * STEP
    seen = replace(episode, cloud_time=stamps)
    played = interact(sling, seen, parameters, until=float(stamps[-1]))
    if played.failure[0]:
        return None
    lines = dict(zip(wanted.tolist(), played.center_line[0], strict=True))
    cost = np.zeros(len(shifts))
    for k in near:
        cloud = episode.clouds[k]
        points = np.asarray(cloud[:: -(-len(cloud) // MOST_POINTS)], float)
        at = np.round((since[k] + shifts) / STEP).astype(int)
        cost += [_off(points, lines[i]) for i in at.tolist()]
    best = int(np.argmin(cost))
    here = cost[np.argmin(np.abs(shifts))]
    if abs(shifts[best]) <= NEAR or cost[best] > here - CLEARLY:
        return None
    return float(shifts[best])


def shows(cloud: np.ndarray, way: float) -> bool:
    """Whether a cloud (P, 3) shows the band, and so far behind the fork [m]."""
    return len(cloud) > LEAST_POINTS and Rule.behind(cloud) > way


def _off(points: np.ndarray, line: np.ndarray) -> float:
    """Mean distance of points (P, 3) from a line (L, 3), each at most FAR [m]."""
    foot, _, _ = nearest(points, line)
    return float(np.minimum(np.linalg.norm(points - foot, axis=1), FAR).mean())
