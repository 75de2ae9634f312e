"""The steps that all slings of a batch take: their lengths and formulas, what the hand does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.simulator.records import STEP, Grip, Mode
from sling2sim2real.simulator.rubber import update

RELAX_STEPS = 40
STATICS_STEPS_S = 10.0 ** np.arange(1, 6)  # s: steps in which inertia counts for nothing


@dataclass
class Schedule:
    """Steps of a batch.

    Attributes:
        steps: Records of records.STEP, shape (S,).
        first_free: Index of the first step after the release.
    """

    steps: np.ndarray
    first_free: int


def steps(times, previous: float, *, grip: Grip, order: int = 1, mode: Mode = Mode.MOVE):
    """Steps that end at `times[1:]`, records (S,): backward Euler, or BDF2 for order 2.

    Args:
        previous: Length of the step before the first one [s], for variable-step BDF2.
    """
    times = np.asarray(times, float)
    result = np.zeros(len(times) - 1, STEP)
    h = np.diff(times)
    ratio = h / np.concatenate([[previous], h[:-1]])
    result["h"], result["beta"] = h, 1
    if order == 2:
        result["past"] = ratio**2 / (1 + 2 * ratio)
        result["beta"] = (1 + ratio) / (1 + 2 * ratio)
    result["mode"], result["grip"], result["time"], result["bending"] = mode, grip, times[1:], 1
    result["forget"], result["follow"] = update(h)
    return result


def relaxation(grip: Grip) -> np.ndarray:
    """Steps that bring a guess to rest, records (RELAX_STEPS,): without speed, ever longer.

    Guesses have kinks. Inertia holds the first steps near them, and the bending stiffness comes in
    little by little; the last steps are statics.
    """
    ramp = RELAX_STEPS - 12
    sizes = np.concatenate([np.geomspace(2e-3, 0.05, ramp), np.full(12, 0.05)])
    times = np.concatenate([[0.0], np.cumsum(sizes)])
    result = steps(times, sizes[0], grip=grip, mode=Mode.RELAX)
    result["bending"][:ramp] = np.geomspace(0.01, 1, ramp)
    return result


def statics(grip: Grip) -> np.ndarray:
    """Steps to rest whatever the band's own times are, records (S,)."""
    return np.concatenate(
        [relaxation(grip), steps(STATICS_STEPS_S, 1.0, grip=grip, mode=Mode.RELAX)]
    )
