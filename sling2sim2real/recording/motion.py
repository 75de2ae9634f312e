"""Where the hand is over time, and how it moves, from the pose's samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation, Slerp

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode import signal
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.streams import Stream

VELOCITY_WINDOW = 0.05  # s of the local cubic fits that are differentiated once
SPARSE = 20  # times longer than its messages at their usual rate would take
DEGREE = 5  # of the splines that are differentiated twice
KNOTS_APART, LEAST_BETWEEN, PHASES = 0.05, 2, 3  # s, in samples at least, and splines


def interpolated(times: np.ndarray | float, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (S, C) at t (S,) at other times, linear between and constant beyond, (..., C)."""
    return np.stack([np.interp(times, t, column) for column in values.T], axis=-1)


def expect_dense(stream: Stream[Any]) -> None:
    """Raises UserError where nearly all of a topic is missing: an even grid would not end."""
    span = (int(stream.stamp[-1]) - int(stream.stamp[0])) * 1e-9
    if span > SPARSE * len(stream.stamp) * stream.period:
        raise UserError(
            f"{stream.topic} has {len(stream.stamp)} messages in {span:.0f} s, most of them"
            f" {1e3 * stream.period:.3g} ms apart: it is missing nearly all the time"
        )


@dataclass(frozen=True)
class Motion:
    """The hand, frame O.

    Attributes:
        time: Of the samples [s], shape (S,).
        path: Tool centre point [m], shape (S, 3).
        turn: Its frame into frame O, S rotations.
        period: Usual time between samples [s].
    """

    time: np.ndarray
    path: np.ndarray
    turn: Rotation
    period: float

    @classmethod
    def of(cls, pose: Stream[np.ndarray], geometry: Geometry, origin: int) -> Motion:
        """Read the motion from the pose topic; seconds since `origin` [ns]. Raises UserError."""
        expect_dense(pose)
        turn = geometry.base.rotation * Rotation.from_quat(pose.values[:, 3:])
        path = geometry.base.apply(pose.values[:, :3])
        return cls(pose.seconds(origin), path, turn, pose.period)

    def position(self, times: np.ndarray | float) -> np.ndarray:
        """Shape (..., 3), linear between samples, at rest beyond them."""
        return interpolated(times, self.time, self.path)

    def orientation(self, times: np.ndarray | float) -> Rotation:
        """The hand's frame into frame O."""
        return self._slerp(np.clip(times, self.time[0], self.time[-1]))

    @cached_property
    def _slerp(self) -> Slerp:
        return Slerp(self.time, self.turn)

    def velocity(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even times (M,), position and velocity there, each (M, 3). Raises UserError.

        Local cubic fits (Savitzky-Golay) on an even grid, onto which the samples are interpolated.
        """
        grid, even = signal.uniform(self.time, self.path, 1 / self.period)
        size = max(5, 2 * round(VELOCITY_WINDOW / self.period / 2) + 1)
        if len(grid) <= size:
            raise UserError("the pose is too short to differentiate")
        velocity = savgol_filter(even, size, 3, deriv=1, delta=self.period, axis=0)
        return grid, even, np.asarray(velocity)

    def acceleration(
        self, times: np.ndarray, point: np.ndarray, jump: float | None = None
    ) -> np.ndarray:
        """Acceleration of a point (3,) fixed in the hand's frame, at times (T,); shape (T, 3).

        The mean of quintic splines, fitted to the samples with knots at several phases. At the time
        `jump` [s], at which a hand that is let go starts back, the acceleration may jump, position
        and velocity may not. Beyond the samples the hand rests.
        """
        path = self.path + self.turn.apply(point)
        splines = [
            make_lsq_spline(self.time, path, knots, DEGREE).derivative(2)(times)
            for knots in _knots(self.time, self.period, jump)
        ]
        mean = np.mean(splines, axis=0)
        mean[(times < self.time[0]) | (times > self.time[-1])] = 0.0
        return mean


def _knots(t: np.ndarray, period: float, jump: float | None) -> Iterator[np.ndarray]:
    """Knots of each spline. They lie on samples, so that none is in a gap without samples."""
    step = max(round(KNOTS_APART / period), LEAST_BETWEEN)
    if len(t) <= 4 * step + DEGREE:
        raise UserError("the pose is too short to differentiate")
    ends = np.ones(DEGREE + 1)
    first, last = t[2 * step], t[-1 - 2 * step]  # further apart where there is but one side
    for phase in range(0, step, -(-step // PHASES)):
        inner = t[phase::step]
        if jump is not None and first < jump < last:
            at = int(np.searchsorted(t, jump))
            before = t[at - 2 * step + phase :: -step][::-1]
            after = t[at + 2 * step - phase :: step]
            inner = np.concatenate([before, [jump] * (DEGREE - 1), after])
        inner = inner[(inner > first) & (inner < last)]
        yield np.concatenate([t[0] * ends, inner, t[-1] * ends])
