"""What a force sensor cannot do: follow beyond its range, or as fast as a band is let go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.grasp import MARGIN
from sling2sim2real.recording.pulls import Pull

WINDOW = 0.05  # s in which noise is looked for
LEAST_SAMPLES = 20  # in it
LONGEST = 0.3  # s of so many samples, in which the hand moves: then only equal values tell
QUIET = 0.25  # share of the free hand's noise, below which there is none
NEAR_TOP = 0.05  # of an axis' way to its extreme value


@dataclass(frozen=True)
class FlatTop:
    """The sensor's range ends.

    Attributes:
        axis: Of the wrench's frame: 0, 1 or 2.
        value: At which it stops [N].
        begin, end: When it does [s].
        frozen: No axis changes: it is the sensor that stopped, not its range.
    """

    axis: int
    value: float
    begin: float
    end: float
    frozen: bool


def flat_top(pull: Pull) -> FlatTop | None:
    """Where the noise disappears at an extreme value of the raw force, before the release."""
    t, raw = pull.force_time, pull.recording.wrench.values
    free, until = t < pull.grasp - MARGIN, t < pull.release.time - MARGIN / 5
    count = max(LEAST_SAMPLES, round(WINDOW / pull.recording.wrench.period))
    if free.sum() < count or until.sum() < 2 * count:
        return None
    noise = _scatter(_windows(raw[free], count)).min(axis=0)  # while it rests
    parts = _windows(raw[until], count)
    change = np.diff(parts, axis=1)
    quick = count * pull.recording.wrench.period < LONGEST
    still = _scatter(parts) <= (QUIET if quick else 0.0) * noise
    rest = raw[free].mean(axis=0)
    far = np.abs(parts.mean(axis=1) - rest)
    top = far > (1 - NEAR_TOP) * far.max(axis=0)
    loaded = far.max(axis=0) > 0.2 * far.max()
    flat = still & top & loaded & (noise > 0)
    if not flat.any():
        return None
    axis = int(np.argmax(flat.sum(axis=0)))
    flat_samples = np.flatnonzero(flat[:, axis])
    begin, end = t[flat_samples[0] * count], t[(flat_samples[-1] + 1) * count - 1]
    value = float(np.median(parts[flat_samples, :, axis]))
    frozen = bool(np.all(change[flat_samples] == 0))
    return FlatTop(axis, value, float(begin), float(end), frozen)


def _windows(x: np.ndarray, count: int) -> np.ndarray:
    """Samples (S, 3) in windows, shape (W, count, 3)."""
    whole = len(x) // count
    return x[: whole * count].reshape(whole, count, 3)


def _scatter(windows: np.ndarray) -> np.ndarray:
    """Scatter of single samples in each window, (W, 3), beside what changes steadily."""
    return np.std(np.diff(windows, axis=1), axis=1) / np.sqrt(2)
