"""When the hand grasps the band and when it lets go, from gripper, force and motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.errors import UserError

SIGMAS = 6.0
LEAST_PULL = 0.5  # N: below it nothing was drawn
GAP = 3.5  # periods of the force around the release
SUDDEN = 0.5  # share of the drop that a release takes within a few hundredths of a second
LEAST_STROKE = 0.002  # m: fingers that move less than this did not move
OPENS = 0.5  # s by which the gripper's topic may come late
LEAD_IN = 0.2  # s at least


@dataclass(frozen=True)
class Release:
    """The end of the pull.

    Attributes:
        time: The force begins to drop [s].
        resolution: Time between force samples around it [s].
        hold: Mean force while held, sensor frame, bias included [N], shape (3,).
        noise: Standard deviation of one force sample along the pull [N].
        drop: How much the force fell [N].
    """

    time: float
    resolution: float
    hold: np.ndarray
    noise: float
    drop: float


def find_release(t: np.ndarray, force: np.ndarray) -> Release:
    """Find the release in a raw force, whose bias need not be known.

    The steepest drop is found first, by the difference of short means before and after; then the
    first sample below the held level by more than the noise. Where the fall takes several samples,
    the line through its first third is followed back to the held level.

    Args:
        t: Times [s], shape (S,).
        force: Any constant frame [N], shape (S, 3).

    Raises:
        UserError: if the force never drops as it does when a drawn band is let go.
    """
    period = float(np.median(np.diff(t)))
    near, far = max(1, round(0.005 / period)), max(3, round(0.05 / period))
    if len(t) < 4 * far:
        raise UserError("the force is too short to find a release in it")
    # Difference of the means over [-far, -near] and [near, far] around each sample.
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(force, axis=0)])
    center = np.arange(far, len(t) - far)
    before = (sums[center - near + 1] - sums[center - far]) / (far - near + 1)
    after = (sums[center + far + 1] - sums[center + near]) / (far - near + 1)
    jump = np.linalg.norm(before - after, axis=1)
    steepest = int(np.argmax(jump))
    coarse = center[steepest]

    quiet = slice(max(0, coarse - 6 * far), coarse - far)
    settled = slice(min(coarse + far, len(t) - 1), min(coarse + 6 * far, len(t)))
    hold, free = force[quiet].mean(axis=0), force[settled].mean(axis=0)
    drop = float(np.linalg.norm(hold - free))
    if drop < LEAST_PULL or jump[steepest] < SUDDEN * drop:
        raise UserError(
            f"the force never drops by {LEAST_PULL} N at once: no release of a drawn band is in it"
        )
    along = force @ ((hold - free) / drop)
    level, spread = along[quiet].mean(), np.diff(along[quiet])
    noise = float(1.4826 * np.median(np.abs(spread - np.median(spread))) / np.sqrt(2))
    threshold = max(SIGMAS * noise, 0.02 * drop)

    window = slice(quiet.stop - far, settled.stop)
    half = window.start + int(np.argmax(along[window] < level - drop / 2))
    held = np.flatnonzero(along[:half] > level - threshold)
    first = int(held[-1]) + 1 if len(held) else half
    resolution = float(t[first] - t[first - 1])
    if resolution > GAP * period:
        raise UserError(
            f"force is missing for {1e3 * resolution:.0f} ms around the release at"
            f" {t[first]:.3f} s: its time cannot be told, record again"
        )
    fall = (level - along) / drop
    return Release(_onset(t, fall, first, threshold / drop), resolution, hold, noise, drop)


def _onset(t: np.ndarray, fall: np.ndarray, first: int, threshold: float) -> float:
    """Follow the first third of the fall (0 held, 1 gone) back to where it began."""
    last = first
    while last + 1 < len(t) and fall[last] < 1 / 3:
        last += 1
    if last == first and fall[first + 1] - fall[first] > 1 / 4:
        last += 1  # still falling: two samples tell how fast
    if last == first:
        return float(t[first])  # all at once: the first sample that has fallen
    slope, offset = np.polyfit(t[first : last + 1] - t[first], fall[first : last + 1], 1)
    if slope <= 0:
        return float(t[first])
    earliest = t[first - 1] - threshold / slope  # the sample before had hardly fallen
    return float(np.clip(t[first] - offset / slope, earliest, t[first]))


def find_grasp(
    gripper: tuple[np.ndarray, np.ndarray] | None,
    pose: tuple[np.ndarray, np.ndarray],
    release: float,
) -> float:
    """The first moment from which the fingers stay closed, or else that the hand lifts.

    Args:
        gripper: Times (G,) [s] and opening (G,) [m], or None where it was not recorded.
        pose: Times (S,) [s] and height (S,) [m] of the hand.
        release: Time of the release [s].

    Raises:
        UserError: if the band was in the hand from the start.
    """
    if gripper is not None:
        _let_go(*gripper, release)
        grasp = _closed(*gripper, release)
        if grasp is not None:
            return grasp
    t, height = pose
    lifted = np.flatnonzero(height - height[0] > 0.005)
    rising = lifted[t[lifted] < release]
    if not len(rising):
        raise UserError(
            "no grasp: the gripper does not close (or was not recorded) and the hand does not lift;"
            " record from before the grasp on"
        )
    return float(t[rising[0]])


def _let_go(t: np.ndarray, opening: np.ndarray, release: float) -> None:
    """The fingers must open when the force drops. Raises UserError where they stay closed."""
    after = (t > release) & (t < release + OPENS)
    held = (t < release) & (t > release - 1.0)
    if after.sum() < 3 or not held.any() or np.ptp(opening) < LEAST_STROKE:
        return
    if opening[after].max() < np.median(opening[held]) + 0.2 * np.ptp(opening):
        raise UserError(
            f"the force drops at {release:.3f} s but the gripper stays closed: the band slipped out"
            " or tore, record again with a firmer grip"
        )


def _closed(t: np.ndarray, opening: np.ndarray, release: float) -> float | None:
    """First sample after which the fingers stay within a tenth of their stroke from closed."""
    before = t < release - 0.05
    holding = before & (t > release - 1.0)
    if not holding.any():
        return None
    closed = np.median(opening[holding])
    stroke = np.max(opening[before]) - closed
    if stroke < LEAST_STROKE:
        return None
    wide = np.flatnonzero(opening[before] > closed + stroke / 10)
    return float(t[wide[-1] + 1]) if wide[-1] + 1 < before.sum() else None
