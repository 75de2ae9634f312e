"""The pose's delay against the force, by the hand that starts back when the band lets it go.

An arm under impedance control gives way to a drawn band and swings back from the moment at which
the force falls; some robots retreat at once. The path is bent at that moment: a line before it, a
cubic after it. A hand that starts back by itself some time after the release looks late, before it
early; so a motion that goes on is believed as far as it is near the release.
"""

from __future__ import annotations

import numpy as np

from pipeline.recording.pulls import Pull

REACH = 0.1  # s around the release in which the start is looked for
SPAN = 0.02  # s over which the path's second difference is taken
QUIET = 0.25  # s before REACH, which tells how still a hand is
SIGMAS = 8.0  # of that, by which the path must bend
LEAST = 3e-5  # m by which it must bend
BEFORE, AFTER = 0.05, 0.03  # s of the path around its bend that are fitted
STEP = 2e-4  # s
FLOOR = 1e-3  # s: standard error, by what the swing of an arm is not a cubic
DEGREE = 3


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
    fitted = 2 + DEGREE
    if near.sum() < 3 * fitted:
        return None
    at, place = time[near] - around, away[near] - away[near].mean()
    begins, left = np.arange(-SPAN, SPAN, STEP), []
    for begin in begins:
        since = np.clip(at - begin, 0, None) / AFTER
        columns = [np.ones_like(at), at / AFTER, *(since**k for k in range(1, DEGREE + 1))]
        design = np.stack(columns, axis=1)
        gap = place - design @ np.linalg.lstsq(design, place, rcond=None)[0]
        left.append(gap @ gap)
    left = np.array(left)
    noise = max(left.min() / (near.sum() - fitted - 1), 1e-14)
    weight = np.exp(-(left - left.min()) / (2 * noise))
    weight /= weight.sum()
    begin = float(weight @ begins)
    spread = float(np.sqrt(weight @ (begins - begin) ** 2))
    return around + begin - release, float(np.hypot(spread, FLOOR))


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
