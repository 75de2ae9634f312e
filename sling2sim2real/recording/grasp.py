"""The moment at which the hand grasps the band: thresholds on the fingers' stroke, or on the lift.

Fingers report in whatever unit, and some numbers grow when the fingers close: thresholds are shares
of the stroke, and the sign is read from what they did before they held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.motion import interpolated

Opening = tuple[np.ndarray, np.ndarray]  # of the gripper: times [s] and opening, both (G,)

MARGIN = 0.05  # s kept clear of the grasp and of the release when means are taken
LEAST_LEAD_IN = 0.2  # s of the empty hand before the grasp, at least: the force is tared there


@dataclass(frozen=True)
class GraspLimits:
    """Thresholds of the fingers and of the hand, each with its unit and what it is for."""

    stroke: float = 0.002  # m, rad, ...: fingers that move less did not move
    jitters: float = 12.0  # robust deviations of the opening's noise: nor did those that move less
    held: float = 1.0  # s before the release: the median opening then is that of closed fingers
    late: float = 0.5  # s by which the gripper's topic may come late
    opened: float = 0.2  # of the range: fingers that moved by so much were or are open
    parts: float = 10.0  # of the stroke: within one of them from closed, fingers are still closed
    lift: float = 0.005  # m: a hand that is so much higher than at its lowest has lifted
    rest: float = 0.02  # m/s: a slower hand rests
    step: float = 0.02  # s over which that speed is taken


LIMITS = GraspLimits()


def find_grasp(
    gripper: Opening | None,
    pose: tuple[np.ndarray, np.ndarray],
    release: float,
) -> float:
    """The first moment from which the fingers stay closed, or else that the hand lifts.

    The hand rests while it grasps: where it moves when the fingers are said to have closed, the
    gripper's topic is late, and the end of the rest just before counts.

    Args:
        gripper: None where it was not recorded.
        pose: Times (S,) [s] and path (S, 3) [m] of the hand, z up.
        release: Time of the release [s].

    Raises:
        UserError: if the band was in the hand from the start, or never let go by the fingers.
    """
    if gripper is not None:
        if fingers_open(*gripper, release) is False:
            raise UserError(
                f"the force drops at {release:.3f} s but the gripper stays closed: the band slipped"
                " out or tore, record again with a firmer grip"
            )
        grasp = fingers_closed(*gripper, release)
        if grasp is not None:
            return _end_of_rest(*pose, grasp)
    t, height = pose[0], pose[1][:, 2]
    before = t < release
    low = np.flatnonzero(before & (height < height[before].min(initial=np.inf) + LIMITS.lift))
    lifted = before & (t > t[low[-1]]) if len(low) else np.zeros(0)
    if not lifted.any():
        raise UserError(
            "no grasp: the gripper does not close (or was not recorded) and the hand does not lift;"
            " record from before the grasp on"
        )
    return float(t[np.argmax(lifted)])


def fingers_open(t: np.ndarray, opening: np.ndarray, release: float) -> bool | None:
    """Whether the fingers open when the force drops; None where they were not seen to move."""
    after = (t > release) & (t < release + LIMITS.late)
    held = (t < release) & (t > release - LIMITS.held)
    if after.sum() < 3 or not held.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    return bool(opening[after].max() > np.median(opening[held]) + LIMITS.opened * np.ptp(opening))


def fingers_closed(t: np.ndarray, opening: np.ndarray, release: float) -> float | None:
    """First time [s] after which the fingers stay closed until the release; None if not seen."""
    before, holding = _until(t, release)
    if not holding.any() or not _moved(opening):
        return None
    opening = _outward(t, opening, release) * opening
    closed = np.median(opening[holding])
    stroke = np.max(opening[before]) - closed
    if stroke < LIMITS.stroke:
        return None
    wide = np.flatnonzero(opening[before] > closed + stroke / LIMITS.parts)
    return float(t[wide[-1] + 1]) if wide[-1] + 1 < before.sum() else None


def _until(t: np.ndarray, release: float) -> tuple[np.ndarray, np.ndarray]:
    """Which times (S,) are before the release, and which of them in its last second."""
    before = t < release - MARGIN
    return before, before & (t > release - LIMITS.held)


def _moved(opening: np.ndarray) -> bool:
    """Whether fingers moved, in whatever unit."""
    jitter = 1.4826 * float(np.median(np.abs(np.diff(opening)))) if len(opening) > 1 else 0.0
    return float(np.ptp(opening)) >= max(LIMITS.stroke, LIMITS.jitters * jitter)


def _outward(t: np.ndarray, opening: np.ndarray, release: float) -> float:
    """1, or -1 where the numbers grow when the fingers close, as a knuckle's angle does.

    Told by what they last were before they hold; by 1 where they were not seen to close.
    """
    before, holding = _until(t, release)
    if not holding.any():
        return 1.0
    away = opening[before] - np.median(opening[holding])
    wide = np.flatnonzero(np.abs(away) > LIMITS.opened * np.ptp(opening))
    return -1.0 if len(wide) and away[wide[-1]] < 0 else 1.0


def _end_of_rest(t: np.ndarray, path: np.ndarray, grasp: float) -> float:
    """`grasp`, or the end of the last rest before it if the hand moves then."""
    times = np.arange(grasp - LIMITS.late, grasp + 1.5 * LIMITS.step, LIMITS.step)
    ways = np.diff(interpolated(times, t, path), axis=0)
    resting = np.linalg.norm(ways, axis=1) < LIMITS.rest * LIMITS.step
    inside = (times[:-1] >= t[0]) & resting
    if inside[-2:].any() or not inside.any():
        return grasp
    return float(times[np.flatnonzero(inside)[-1] + 1])
