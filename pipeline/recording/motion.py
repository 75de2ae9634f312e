"""Where the hand is over time, and how it moves, from the pose's samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import savgol_filter
from scipy.spatial.transform import Rotation, Slerp

from pipeline import signal
from pipeline.errors import UserError
from pipeline.recording.geometry import Geometry
from pipeline.recording.input.reader import Stream

VELOCITY_WINDOW = 0.05  # s of the local cubic fits that are differentiated once
SPARSE = 20  # times longer than its messages at their usual rate would take
ACCELERATION_WINDOW = 0.15  # s of the quintic ones that are differentiated twice


def expect_dense(stream: Stream) -> None:
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
    def of(cls, pose: Stream, geometry: Geometry, origin: int) -> Motion:
        """From the pose topic; seconds since `origin` [ns]. Raises UserError."""
        expect_dense(pose)
        turn = geometry.base.rotation * Rotation.from_quat(pose.values[:, 3:])
        path = geometry.base.apply(pose.values[:, :3])
        return cls(pose.seconds(origin), path, turn, pose.period)

    def position(self, times: np.ndarray) -> np.ndarray:
        """Shape (..., 3), linear between samples, at rest beyond them."""
        axes = [np.interp(times, self.time, axis) for axis in self.path.T]
        return np.stack(axes, axis=-1)

    def orientation(self, times: np.ndarray) -> Rotation:
        """The hand's frame into frame O."""
        return self._slerp(np.clip(times, self.time[0], self.time[-1]))

    @cached_property
    def _slerp(self) -> Slerp:
        return Slerp(self.time, self.turn)

    def velocity(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Even times (M,), position and velocity there, each (M, 3).

        Local cubic fits (Savitzky-Golay) on an even grid, onto which the samples are interpolated.
        """
        return self._derived(self.path, VELOCITY_WINDOW, 3, 1)

    def acceleration(
        self, times: np.ndarray, point: np.ndarray, jump: float | None = None
    ) -> np.ndarray:
        """Of a point (3,) that is fixed in the hand's frame, at times (T,); shape (T, 3).

        Nothing is smoothed over the time `jump` [s], at which a hand that is let go starts back.
        """
        path = self.path + self.turn.apply(point)
        jump = np.inf if jump is None else jump
        found = np.empty((len(times), 3))
        for samples, wanted in (
            (self.time < jump, times < jump),
            (self.time >= jump, times >= jump),
        ):
            if wanted.any():
                grid, _, second = self._derived(path, ACCELERATION_WINDOW, 5, 2, samples)
                at = [np.interp(times[wanted], grid, axis) for axis in second.T]
                found[wanted] = np.stack(at, axis=-1)
        return found

    def _derived(
        self, path: np.ndarray, window: float, degree: int, order: int, part=slice(None)
    ) -> tuple[np.ndarray, ...]:
        grid, even = signal.uniform(self.time[part], path[part], 1 / self.period)
        size = max(degree + 2, 2 * round(window / self.period / 2) + 1)
        if len(grid) <= size:
            raise UserError("the pose is too short to differentiate")
        return grid, even, savgol_filter(even, size, degree, deriv=order, delta=self.period, axis=0)
