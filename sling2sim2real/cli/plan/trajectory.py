"""A path of the tool centre point as a cubic spline in time, with what the fingers do on the way.

Each phase is a straight leg with rest at both ends, or a rest. On a leg of length L in time T the
third derivative is +, -, + for a quarter, a half and a quarter of T, so that position, velocity and
acceleration are continuous and begin and end at zero, as robots ask for:

    largest speed 2 L / T, halfway;    largest acceleration 8 L / T^2, at a quarter and at three
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline

# Of a leg of length 1 in time 1: knots, and place and speed there.
KNOTS, PLACES, SPEEDS = (0.25, 0.75, 1.0), (1 / 12, 11 / 12, 1.0), (1.0, 1.0, 0.0)


@dataclass(frozen=True)
class Phase:
    """One leg, or a rest where the path is there already.

    Attributes:
        name: What happens.
        to: Where it ends [m], shape (3,).
        duration: Time it takes [s], above 0.
        opening: Distance between the fingers at its end [m]; it changes evenly.
    """

    name: str
    to: np.ndarray
    duration: float
    opening: float


@dataclass(frozen=True)
class Trajectory:
    """Phases one after the other, from time 0 on.

    Attributes:
        phases: What happens.
        path: Position by time, shape (3,) each; three cubics a phase.
        times: When phases begin, and the last one ends [s], shape (len(phases) + 1,).
        openings: Distance between the fingers at those times [m].
    """

    phases: tuple[Phase, ...]
    path: CubicHermiteSpline
    times: np.ndarray
    openings: np.ndarray

    @classmethod
    def through(cls, start: np.ndarray, opening: float, phases: Sequence[Phase]) -> Trajectory:
        """Begin at rest at `start` (3,) with fingers `opening` apart [m]."""
        ends = np.array([start, *(phase.to for phase in phases)], float)
        times = np.cumsum([0.0, *(phase.duration for phase in phases)])
        ways, durations = np.diff(ends, axis=0), np.diff(times)
        knots = times[:-1, None] + durations[:, None] * KNOTS
        knots[:, -1] = times[1:]
        places = ends[:-1, None] + ways[:, None] * np.array(PLACES)[:, None]
        places[:, -1] = ends[1:]
        speeds = (ways / durations[:, None])[:, None] * np.array(SPEEDS)[:, None]
        path = CubicHermiteSpline(
            np.append(0.0, knots.ravel()),
            np.vstack([ends[:1], places.reshape(-1, 3)]),
            np.vstack([np.zeros((1, 3)), speeds.reshape(-1, 3)]),
        )
        openings = np.array([opening, *(phase.opening for phase in phases)])
        return cls(tuple(phases), path, times, openings)

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def start_of(self, name: str) -> float:
        """Time at which the phase of that name begins [s]. Raises KeyError."""
        for phase, time in zip(self.phases, self.times, strict=False):
            if phase.name == name:
                return float(time)
        raise KeyError(name)

    def position(self, time: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Position, or a derivative of it by time, at times (...) [s], shape (..., 3).

        Before and after the phases the hand rests.
        """
        return self.path(np.clip(time, 0.0, self.duration), derivative)

    def opening(self, time: np.ndarray | float) -> np.ndarray | float:
        """Distance between the fingers at times (...) [m], as commanded."""
        return np.interp(time, self.times, self.openings)

    def phase_at(self, time: np.ndarray) -> list[str]:
        """Names of the phases at times (N,)."""
        index = np.searchsorted(self.times[1:-1], time, side="right")
        return [self.phases[i].name for i in index]

    def peaks(self, derivative: int) -> np.ndarray:
        """Largest speed (1) or acceleration (2) of each phase, shape (len(phases),)."""
        places = self.path(self.times)
        lengths, times = np.linalg.norm(np.diff(places, axis=0), axis=1), np.diff(self.times)
        return 2 * lengths / times if derivative == 1 else 8 * lengths / times**2
