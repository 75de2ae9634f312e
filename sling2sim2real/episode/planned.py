"""A planned pull as an episode without force or clouds: where the hand goes, and when."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.episode.episode import Episode
from sling2sim2real.settings.lab import Dip
from sling2sim2real.settings.recording import EpisodeParams

REST, GRASP_TIME, LIFT_TIME, SPARE = 0.3, 0.1, 1.2, 0.3  # s
CAMERA = (0.80, 0.32, 0.50)  # m, where a planned pull is looked at from


class Leg(NamedTuple):
    """A leg of the way from the fork to the draw, or of its dips.

    Attributes:
        name: PULL, LET_BACK or REDRAW.
        share: Of the draw, where it ends.
        time: That it takes [s]; None: what its part of the pull takes.
    """

    name: str
    share: float
    time: float | None


PULL, LET_BACK, REDRAW = "pull", "let back", "redraw"


def legs_of(dips: Sequence[Dip], length: float) -> list[Leg]:
    """Legs of a pull of `length` [m] with dips; those at one place come in the order given."""
    legs, reached = [], 0.0
    for dip in sorted(dips, key=lambda dip: dip.at):
        if dip.at > reached:
            legs.append(Leg(PULL, dip.at, None))
        legs.append(Leg(LET_BACK, dip.at - dip.depth / length, dip.out_time))
        legs.append(Leg(REDRAW, dip.at, dip.back_time))
        reached = dip.at
    return legs if reached == 1 else [*legs, Leg(PULL, 1.0, None)]


def leg_time(length: float, speed: float, acceleration: float) -> float:
    """Shortest time of a leg [s] that stays within a speed [m/s] and an acceleration [m/s^2].

    Of a robot that follows sling2sim2real/cli/plan/trajectory.py.
    """
    return max(2 * length / speed, float(np.sqrt(8 * length / acceleration)))


def planned_pull(
    params: EpisodeParams,
    band: str,
    hanging: float,
    draw: tuple[float, float] = (-0.40, 0.0),
    *,
    pull_time: float = 1.5,
    pause: float = 1.0,
    frame_rate: float = 30.0,
    dips: Sequence[Dip] = (),
) -> Episode:
    """The hand takes the hanging band, lifts it, draws it, pauses and lets go.

    Args:
        hanging: Height of the hanging band's middle, frame O [m].
        draw: Where the middle is drawn to (y, z), frame O [m].
        pull_time: For the way there [s].
        pause: From there to the release [s].
        frame_rate: Of the camera [Hz].
        dips: Of the pull, whose own parts take `pull_time` together.
    """
    period = params.duration / params.samples
    grasp, lifted = REST, REST + LIFT_TIME
    taken = grasp + GRASP_TIME
    legs = legs_of(dips, float(np.hypot(*draw)))
    shares = np.array([0.0, *(leg.share for leg in legs)])
    ways = np.diff(shares)
    legs_and_ways = zip(legs, ways, strict=True)
    times = [pull_time * way if leg.time is None else leg.time for leg, way in legs_and_ways]
    ends = lifted + np.append(0.0, np.cumsum(times))
    release = ends[-1] + pause
    end = release + params.tail + SPARE
    time = period * (np.arange(int(end / period)) + 0.5)
    start, below, there = (np.array(place) for place in ([0, 0, hanging], [0, 0, 0], [0, *draw]))
    position = start + np.outer(minimum_jerk((time - taken) / (lifted - taken)), below - start)
    for way, begin, until in zip(ways, ends[:-1], ends[1:], strict=True):
        position += np.outer(minimum_jerk((time - begin) / (until - begin)), way * there)
    frames = np.arange(int(time[-1] * frame_rate)) / frame_rate
    return Episode(
        band=band,
        time=time,
        position=position,
        velocity=np.gradient(position, period, axis=0),
        force=np.zeros_like(position),
        opening=np.full(len(time), np.nan),
        cloud_time=frames,
        clouds=[np.zeros((0, 3), np.float32)] * len(frames),
        grasp_time=grasp,
        release_time=release,
        camera=np.array(CAMERA),
        metadata={"input": {"file": "planned"}},
    )
