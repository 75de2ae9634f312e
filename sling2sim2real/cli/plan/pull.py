"""The phases of a recording: rest, grasp the hanging middle, lift, pull, pause, let go, wait.

A pull has dips, in which the band is let back and drawn again: they show how it unloads. For
several pulls in one recording the hand returns to where it began and does it all again.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from scipy.optimize import brentq

from sling2sim2real.cli.plan.trajectory import Phase, Trajectory
from sling2sim2real.episode.planned import LET_BACK, REDRAW, leg_time, legs_of
from sling2sim2real.episode.window import LEAD
from sling2sim2real.recording.events import CALM
from sling2sim2real.settings.lab import PlanParams, SetupParams
from sling2sim2real.settings.recording import EpisodeParams
from sling2sim2real.simulator.model import BandSizes

TICK = 0.001  # s: phases last whole ticks
BACK = LET_BACK, REDRAW
SPARE = 0.5  # s beyond what the episode asks for, since nobody starts a recorder on the tick


def catenary_sag(length: float, width: float) -> float:
    """How far the middle of a string hangs below its ends, `width` apart at equal heights [m].

    An inextensible string without bending stiffness hangs as z = a cosh(x / a): its length is
    2 a sinh(width / 2 a), and its sag a (cosh(width / 2 a) - 1).
    """
    ratio = length / width
    if ratio <= 1:
        raise ValueError(f"a string of {length} m does not reach across {width} m")
    high = math.sqrt(6 * (ratio - 1))  # since sinh(u) / u > 1 + u^2 / 6
    u = high
    if high > 1e-4:
        u = cast(float, brentq(lambda u: math.sinh(u) / u - ratio, 1e-9 * high, high))
    return width / (2 * u) * (math.cosh(u) - 1)


def hanging_middle(plan: PlanParams, setup: SetupParams, band: BandSizes) -> np.ndarray:
    """Where the fingers take the band, frame O, shape (3,): plan.hanging, else a catenary's."""
    below = plan.hanging
    if below is None:
        below = catenary_sag(band.rest_length, setup.fork_width)
    return np.array([0.0, 0.0, -below])


def trajectory_of(
    plan: PlanParams,
    setup: SetupParams,
    episode: EpisodeParams,
    band: BandSizes,
    axis: np.ndarray,
    pulls: int = 1,
) -> Trajectory:
    """The whole recording, frame O.

    Args:
        plan, setup, episode, band: Those sections of params.
        axis: Unit vector along which the fingers point, shape (3,); they come and go along it.
        pulls: How many, one after the other.
    """
    middle = hanging_middle(plan, setup, band)
    level = np.zeros(3)
    drawn = np.array([0.0, *plan.draw])
    start, end = middle - plan.approach * axis, drawn - plan.retreat * axis
    wide, closed = plan.gripper.open, plan.gripper.closed

    def leg(name: str, begin: np.ndarray, to: np.ndarray, speed: float, opening: float) -> Phase:
        time = leg_time(float(np.linalg.norm(to - begin)), speed, plan.max_acceleration)
        return Phase(name, to, _ticks(time), opening)

    retreat = leg("retreat", drawn, end, plan.max_speed, wide)
    back = leg("return", end, start, plan.max_speed, wide)
    way, place = [], level
    for name, share, time in legs_of(plan.dips, float(np.linalg.norm(drawn))):
        to = share * drawn
        phase = leg(name, place, to, plan.pull_speed, closed)
        way.append(phase if time is None else Phase(name, to, _ticks(time), closed))
        place = to
    approach = leg("approach", start, middle, plan.max_speed, wide)
    held = [
        Phase("grasp", middle, _ticks(plan.finger_time), closed),
        leg("lift", middle, level, plan.max_speed, closed),
        *way,
        Phase("pause", drawn, _ticks(plan.pause), closed),
    ]
    release = Phase("release", drawn, _ticks(plan.finger_time), wide)
    pull = [approach, *held, release]
    taken = sum(phase.duration for phase in pull)
    wait = max(
        plan.wait,
        episode.tail + SPARE - plan.finger_time,
        episode.duration + SPARE - plan.lead_in - taken - retreat.duration,
    )
    pull += [Phase("swing", drawn, _ticks(wait), wide), retreat]
    # The next pull's window begins so long before its tail, and the band is to hang calm by then.
    before = max(episode.duration - episode.tail, LEAD + sum(phase.duration for phase in held))
    between = wait + retreat.duration + back.duration + taken
    rest = max(plan.lead_in, CALM + SPARE + before - between)
    again = [back, Phase("lead-in", start, _ticks(rest), wide), *pull]
    phases = [Phase("lead-in", start, _ticks(plan.lead_in), wide), *pull, *(pulls - 1) * again]
    return Trajectory.through(start, wide, [phase for phase in phases if phase.duration > 0])


def _ticks(time: float) -> float:
    return math.ceil(round(time / TICK, 6)) * TICK
