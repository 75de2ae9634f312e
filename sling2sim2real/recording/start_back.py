"""The pose's delay against the force, by the hand that starts back when the band lets it go.

An arm under impedance control gives way to a drawn band and swings back from the moment at which
the force falls. It has mass, so its speed does not jump: what bends its path begins with the square
of the time since. Some robots retreat at once, at a speed that jumps; then the moment is known less
well. A hand that starts back by itself some time after the release looks late, before it early; so
a motion that goes on is believed as far as it is near the release.

The release is as the force shows it, whose samples may be a millisecond apart. The path tells the
moment better than that; an error of the release's time is the same in what is found here.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.recording.events import Pull

REACH = 0.1  # s around the release in which the start is looked for
SPAN = 0.02  # s over which the path's second difference is taken
QUIET = 0.25  # s before REACH, which tells how still a hand is
SIGMAS = 8.0  # of that, by which the path must bend
LEAST = 3e-5  # m by which it must bend
BEFORE, AFTER = 0.05, 0.04  # s of the path around its bend that are fitted
STEP = 1e-4  # s
SLOW = 2  # degree of what the hand does besides
SWINGS, JUMPS = (2, 3, 4), (1, 2, 3)  # powers of the time since the bend
FLOOR, JUMPED = 1e-4, 1e-3  # s: standard errors, by what a path is not such a polynomial
CLEARLY = 4.0  # times less left of the path, or it does not jump


def start_back(pull: Pull) -> tuple[float, float] | None:
    """Delay and its standard error [s]; None where the hand does not start back at the release."""
    release, motion = pull.release.time, pull.motion
    hand = motion.position(release)
    if not np.linalg.norm(hand) > 0 or motion.period > SPAN / 4:
        return None
    time, away = motion.time, motion.path @ hand / np.linalg.norm(hand)
    around = _bend(time, away, release)
    if around is None:
        return None
    near = (time > around - BEFORE) & (time <= around + AFTER)
    if near.sum() < 3 * (SLOW + len(SWINGS) + 1):
        return None
    at, place = time[near] - around, away[near] - away[near].mean()
    begin, spread, left = _begin(at, place, SWINGS)
    floor, jump = FLOOR, _begin(at, place, JUMPS)
    if CLEARLY * jump[2] < left:
        (begin, spread, _), floor = jump, JUMPED
    sudden = max(pull.release.fall - pull.release.resolution, 0.0)  # within a sample it is at once
    late = around + begin - (release + sudden / 2)
    return late, float(np.hypot(np.hypot(spread, floor), sudden / 4))


def _begin(
    at: np.ndarray, place: np.ndarray, powers: tuple[int, ...]
) -> tuple[float, float, float]:
    """Time at which a path (N,) [m] at times (N,) is bent [s], its standard error, the residual.

    Args:
        powers: Of the time since.
    """
    slow = np.vander(at / AFTER, SLOW + 1)
    begins, left = np.arange(-SPAN, SPAN, STEP), []
    for begin in begins:
        since = np.clip(at - begin, 0, None) / AFTER
        design = np.column_stack([slow, *(since**k for k in powers)])
        gap = place - design @ np.linalg.lstsq(design, place, rcond=None)[0]
        left.append(gap @ gap)
    left = np.array(left)
    noise = max(left.min() / (len(at) - SLOW - len(powers) - 2), 1e-14)
    weight = np.exp(-(left - left.min()) / (2 * noise))
    weight /= weight.sum()
    begin = float(weight @ begins)
    return begin, float(np.sqrt(weight @ (begins - begin) ** 2)), float(left.min())


def _bend(time: np.ndarray, away: np.ndarray, release: float) -> float | None:
    """About when the path (S,) is first bent away from the fork around the release [s]."""
    grid = np.arange(release - REACH - QUIET, release + REACH + 2 * SPAN, 1e-3)
    if grid[0] < time[0] or grid[-1] > time[-1]:
        return None
    path, reach = np.interp(grid, time, away), round(SPAN / 1e-3)
    bend = path[2 * reach :] - 2 * path[reach:-reach] + path[: -2 * reach]
    middle = grid[reach:-reach] - release
    still, looked = middle < -REACH, np.abs(middle) < REACH
    top = bend[looked].max()
    if top < max(LEAST, SIGMAS * bend[still].std()):
        return None
    return float(grid[reach:-reach][looked][np.argmax(bend[looked] > top / 2)])
