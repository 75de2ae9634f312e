"""What the robot does: a path through waypoints, tracking errors, fingers that close and open.

Positions are of the tool centre point between the finger tips, in frame O. Each leg is a cubic
with rest at both ends; smooth wander is added to what is commanded. An arm with some give follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rig.physics.compiled import compiled
from sling2sim2real.base.errors import UserError

if TYPE_CHECKING:
    from sling2sim2real.settings.lab import Dip

# Seconds from the start of a recording without dips, which delay what comes after them.
START = 0.4  # the hand leaves its place
REACHED, GRASP = 0.8, 1.0  # it is there and its fingers close; they hold the band
PULL, PULLED = 2.0, 6.0  # the middle is at the tips' height; it is drawn
OPEN = 8.0  # the fingers begin to open
RETREAT, RETREATED, END = 8.3, 9.3, 10.0
PULL_LENGTH = 0.40
APPROACH_LENGTH = 0.10  # m behind the hanging band, where the hand starts
RETREAT_LENGTH = 0.06
TRAVEL_TIME = 0.1  # of the fingers, which close from REACHED and open from OPEN on
FINGER_OPEN, FINGER_CLOSED = 0.04, 0.008  # of each finger joint
WANDER_TONES = 6
WANDER_BAND = 0.1, 1.5  # Hz


class Path(NamedTuple):
    """Legs from point to point with rest at both ends, and wander.

    Attributes:
        times, points: Of the legs' ends, shapes (P,) [s] and (P, 3) [m].
        amplitude, frequency, phase: Of the wander, shapes (tones, 3), (tones, 1), (tones, 3).
    """

    times: np.ndarray
    points: np.ndarray
    amplitude: np.ndarray
    frequency: np.ndarray
    phase: np.ndarray


@compiled
def place(time: float, path: Path) -> np.ndarray:
    """Position, velocity and acceleration, shape (3, 3)."""
    legs = len(path.times) - 1
    leg = min(max(np.searchsorted(path.times, time) - 1, 0), legs - 1)
    duration = path.times[leg + 1] - path.times[leg]
    part = (time - path.times[leg]) / duration
    shape = part**2 * (3 - 2 * part), 6 * part * (1 - part), 6 - 12 * part
    rows = np.empty((3, 3))
    for c in range(3):
        way = path.points[leg + 1, c] - path.points[leg, c]
        rows[0, c] = path.points[leg, c] + way * shape[0]
        rows[1, c], rows[2, c] = way * shape[1] / duration, way * shape[2] / duration**2
        for tone in range(len(path.frequency)):
            rate, size = 2 * np.pi * path.frequency[tone, 0], path.amplitude[tone, c]
            sine, cosine = (
                np.sin(rate * time + path.phase[tone, c]),
                np.cos(rate * time + path.phase[tone, c]),
            )
            rows[0, c] += size * sine
            rows[1, c] += size * rate * cosine
            rows[2, c] -= size * rate**2 * sine
    return rows


@compiled
def places(times: np.ndarray, path: Path) -> np.ndarray:
    """`place` at times (T,), shape (T, 3, 3)."""
    rows = np.empty((len(times), 3, 3))
    for i in range(len(times)):
        rows[i] = place(times[i], path)
    return rows


@dataclass(frozen=True)
class HandMotion:
    """Path of the tool centre point and state of the fingers.

    Attributes:
        path: Of the tool centre point.
        opening: From the first motion of the fingers until they press no more [s], and the power of
            the part of it that is left by which the pads' force falls.
        opens: When the fingers begin to open [s].
        end: Of the recording [s].
    """

    path: Path
    opening: tuple[float, float]
    opens: float
    end: float

    @classmethod
    def through(
        cls,
        hanging: np.ndarray,
        tracking_error: float,
        opening: tuple[float, float],
        rng: np.random.Generator,
        dips: Sequence[Dip] = (),
    ) -> HandMotion:
        """Grasp the middle where it hangs (3,), lift it to the tips, pull, let go, retreat.

        Args:
            tracking_error: Standard deviation of the wander of each axis [m].
            dips: Of the pull.

        Raises:
            UserError: A dip leads beyond the fork.
        """
        back = np.array([0.0, -1.0, 0.0])
        pull = pull_legs(dips)
        late = pull[-1][0] - PULLED
        drawn = PULL_LENGTH * back
        start = hanging + APPROACH_LENGTH * back
        end = drawn + RETREAT_LENGTH * back
        after = [time + late for time in (RETREAT, RETREATED, END)]
        times = np.array([0.0, START, REACHED, GRASP, *(time for time, _ in pull), *after])
        points = [start, start, hanging, hanging, *(way * back for _, way in pull), drawn, end, end]
        amplitude = rng.normal(size=(WANDER_TONES, 3))
        amplitude *= tracking_error * np.sqrt(2 / np.sum(amplitude**2, axis=0))
        frequency = rng.uniform(*WANDER_BAND, (WANDER_TONES, 1))
        phase = rng.uniform(0, 2 * np.pi, (WANDER_TONES, 3))
        path = Path(times, np.array(points), amplitude, frequency, phase)
        return cls(path, opening, OPEN + late, END + late)

    def position(self, time: np.ndarray | float, derivative: int = 0) -> np.ndarray:
        """Position, or a derivative of it by time, at times (...) [s], shape (..., 3)."""
        flat = np.ravel(np.asarray(time, float))
        return places(flat, self.path)[:, derivative].reshape(*np.shape(time), 3)

    def grip(self, time: np.ndarray | float) -> np.ndarray:
        """How firmly the closed pads press, from 1 to 0 as the fingers begin to open."""
        duration, shape = self.opening
        return np.clip(1 - (np.asarray(time) - self.opens) / duration, 0.0, 1.0) ** shape

    def finger(self, time: np.ndarray) -> np.ndarray:
        """Position of each finger joint [m]."""
        turns = [REACHED, REACHED + TRAVEL_TIME, self.opens, self.opens + TRAVEL_TIME]
        closed = np.interp(time, turns, [0.0, 1.0, 1.0, 0.0])
        return FINGER_OPEN + (FINGER_CLOSED - FINGER_OPEN) * closed


def pull_legs(dips: Sequence[Dip]) -> list[tuple[float, float]]:
    """Times at which each leg of the pull ends [s], and how far the band is drawn then [m].

    A dip on the way splits the pull, whose own legs take as long as without it; dips at one place
    come in the order given. Raises UserError where one leads beyond the fork.
    """
    ends, reached = [(PULL, 0.0)], 0.0

    def go(way: float, duration: float) -> None:
        ends.append((ends[-1][0] + duration, way))

    def pull_to(share: float) -> None:
        nonlocal reached
        if share > reached:
            go(share * PULL_LENGTH, (share - reached) * (PULLED - PULL))
            reached = share

    for dip in sorted(dips, key=lambda dip: dip.at):
        drawn = dip.at * PULL_LENGTH
        if dip.depth > drawn:
            raise UserError(
                f"plan.dips: a dip of {dip.depth:g} m leads beyond the fork where the band is"
                f" drawn by {drawn:g} m; lower its depth or raise its at"
            )
        pull_to(dip.at)
        go(drawn - dip.depth, dip.out_time)
        go(drawn, dip.back_time)
    pull_to(1.0)
    return ends


def pull_history(
    step: float, pull_time: float | None = None, pause: float | None = None
) -> np.ndarray:
    """Drawn distance, 0 to 1, every `step` seconds from the start of the pull to the release.

    Without dips: a rubber does not depend on how it is recorded.

    Args:
        pull_time, pause: Of the hand [s]; None: as it records a band.
    """
    pull_time = PULLED - PULL if pull_time is None else pull_time
    pause = OPEN - PULLED if pause is None else pause
    part = np.clip(np.arange(0, pull_time + pause + step / 2, step) / pull_time, 0, 1)
    return part**2 * (3 - 2 * part)
