"""The zero of a force sensor: set while recording, drifting, or another one after the load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import find_peaks
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.release import means, reach, sample_noise

LEAST_STEP = 0.03  # of the largest sudden change: less may be a hand that starts or stops
SIGMAS = 6.0  # of a mean: what is less sudden than this is noise
INSTANT = 0.7  # share of a lasting change that comes at once
MATCH = 0.4  # share of a step by which the zeros before and after it may differ otherwise
MOST_TOOL = 3.0  # kg that a sensor carries
AROUND = 0.1  # s of the hand's path on either side of where its acceleration may jump
RESTS = 0.002  # m by which a hand at rest may wander meanwhile
FREE = 0.5  # s at each end, at most, of which the zero is taken
BLOCK = 0.05  # s: means over so long are independent of one another
LEAST_BLOCKS = 6
SURE = 4.0  # standard errors
MATTERS = 0.01  # of the drop, from which a drift's course is looked at
OTHER = 0.5  # of a steady drift, by which its slope in a window may differ


@dataclass(frozen=True)
class NewZero:
    """The sensor was zeroed: from `time` [s] on its values are greater by `size` (3,) [N]."""

    time: float
    size: np.ndarray


Hand = Callable[[np.ndarray], np.ndarray]  # times (T,) [s] to its places (T, 3) [m]


def zeroed(
    t: np.ndarray, force: np.ndarray, hand: Hand | None = None
) -> tuple[np.ndarray, list[NewZero]]:
    """The force with the zero that it has at the end, and when that was set.

    A sudden change that lasts is another zero where the free hand at the end feels that much more
    than the free hand at the start. A band that slips or is let go leaves both as they are. A hand
    that starts or stops makes such changes too, by the inertia of its tool, and the zero may have
    drifted as much meanwhile.

    Args:
        t: Times [s], shape (S,).
        force: A frame that is fixed to the sensor [N], shape (S, 3).
        hand: None where its motion is not known.
    """
    try:
        near, far = reach(t)
    except UserError:
        return force, []
    before, after = means(force, near, far)
    size = np.linalg.norm(after - before, axis=1)
    size[: far + 1] = size[-far:] = 0
    noise = sample_noise(force) * np.sqrt(6 / (far - near + 1))  # of a difference of two means
    least = max(SIGMAS * noise, LEAST_STEP * size.max())
    peaks, _ = find_peaks(size, height=least, distance=far)
    found_at = (_step_at(t, force, int(i), near, far) for i in peaks)
    steps = [
        zero_step for zero_step in found_at if zero_step and np.linalg.norm(zero_step[1]) > least
    ]
    steps.sort(key=lambda zero_step: -np.linalg.norm(zero_step[1]))
    zeros, values = [], force.copy()
    for k, step in steps:
        begin = min(k, int(np.searchsorted(t, t[0] + FREE)))
        end = max(k, int(np.searchsorted(t, t[-1] - FREE)))
        # Medians, for the hand may have begun to move by then.
        change = np.median(values[end:], axis=0) - np.median(values[:begin], axis=0)
        size = float(np.linalg.norm(step))
        if np.linalg.norm(change - step) < MATCH * size and not (
            hand and size < MOST_TOOL * _jump(hand, float(t[k]))
        ):
            values[:k] += step
            zeros.append(NewZero(float(t[k]), step))
    return (values, sorted(zeros, key=lambda zero: zero.time)) if zeros else (force, [])


def _jump(hand: Hand, time: float) -> float:
    """Jump of the hand's acceleration at that time [m/s^2]; 0 of a hand that rests."""
    since = np.linspace(-AROUND, AROUND, 41)
    places = hand(time + since)
    if np.linalg.norm(places - places[0], axis=1).max() < RESTS:
        return 0.0
    before, after = (  # of cubics through either side
        2 * np.polyfit(since[side], places[side], 3)[1] for side in (slice(21), slice(20, None))
    )
    return float(np.linalg.norm(after - before))


def _step_at(
    t: np.ndarray, force: np.ndarray, i: int, near: int, far: int
) -> tuple[int, np.ndarray] | None:
    """The first sample after a step near sample i, and its size; None where it comes slowly."""
    around = max(2 * near + 3, far // 2)
    begin, end = max(0, i - around), min(len(t), i + around)
    x, s = force[begin:end], t[begin:end] - t[i]
    best: tuple[float, int, np.ndarray] | None = None
    for k in range(i - 2 * near, i + 2 * near + 1):
        if not begin + 3 <= k <= end - 3:
            continue
        terms = np.stack([np.ones_like(s), s, np.arange(begin, end) >= k], axis=1)
        solved, *_ = np.linalg.lstsq(terms, x, rcond=None)
        left = float(np.sum((x - terms @ solved) ** 2))
        if best is None or left < best[0]:
            best = left, k, solved[2]
    if best is None:
        return None
    _, k, step = best
    at_once = force[k : k + near].mean(axis=0) - force[max(0, k - near) : k].mean(axis=0)
    along = at_once @ step / max(float(step @ step), 1e-12)
    return (k, step) if along > INSTANT else None


@dataclass(frozen=True)
class Drift:
    """The sensor's zero before and after the load, in its own frame.

    Attributes:
        rate: Of a steady drift, that is to be taken out (3,) [N/s]; 0 where it is not steady.
        change: From the lead-in to the free hand at the end (3,) [N]; None where that says nothing.
        error: Standard deviation of its length [N].
        steady: Whether the course within both windows agrees with a steady drift.
    """

    rate: np.ndarray
    change: np.ndarray | None = None
    error: float = 0.0
    steady: bool = True

    def seen_from(self, turn: Rotation) -> Drift:
        """The drift in another frame, into which `turn` turns the sensor's."""
        change = None if self.change is None else turn.apply(self.change)
        return replace(self, rate=turn.apply(self.rate), change=change)


def drift_of(
    t: np.ndarray, rest: np.ndarray, lead_in: np.ndarray, end: np.ndarray, drop: float
) -> Drift:
    """How the zero moves between two windows in which the hand is free.

    Args:
        t: Times [s], shape (S,).
        rest: The sensor's force without the tool's load [N], shape (S, 3).
        lead_in, end: The windows, shape (S,).
        drop: Of the force at the release [N].
    """
    if end.sum() < 20:
        return Drift(np.zeros(3))
    change = rest[end].mean(axis=0) - rest[lead_in].mean(axis=0)
    size = float(np.linalg.norm(change))
    rate = change / (t[end].mean() - t[lead_in].mean())
    along = rest @ (change / max(size, 1e-12))
    courses = [course(t[which], along[which]) for which in (lead_in, end)]
    error = float(np.hypot(courses[0][2], courses[1][2]))
    speed = float(np.linalg.norm(rate))
    other = any(
        abs(slope - speed) > max(SURE * spread, OTHER * speed) for slope, spread, _ in courses
    )
    if size > max(MATTERS * drop, SURE * error) and other:
        return Drift(np.zeros(3), change, error, steady=False)
    return Drift(rate, change, error)


def course(t: np.ndarray, x: np.ndarray) -> tuple[float, float, float]:
    """Slope of x (S,) [N/s], its standard error, and that of the mean [N], by means of blocks."""
    count = int((t[-1] - t[0]) / BLOCK)
    if count < LEAST_BLOCKS:
        return 0.0, np.inf, float(np.std(x))
    blocks = np.array_split(np.arange(len(t)), count)
    at, averages = (np.array([v[block].mean() for block in blocks]) for v in (t - t.mean(), x))
    slope, middle = np.polyfit(at, averages, 1)
    spread = float(np.sqrt(np.sum((averages - slope * at - middle) ** 2) / (count - 2)))
    # A slow swing makes neighbouring blocks alike: there are fewer that are independent.
    left = averages - slope * at - middle
    alike = np.clip(np.sum(left[1:] * left[:-1]) / max(np.sum(left**2), 1e-30), 0, 0.95)
    spread *= np.sqrt((1 + alike) / (1 - alike))
    return float(slope), spread / float(np.sqrt(np.sum(at**2))), spread / float(np.sqrt(count))
