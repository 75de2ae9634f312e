"""The tool's load on the force sensor: weight that turns with the hand, and inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.recording.geometry import Geometry
from pipeline.recording.motion import Motion

GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2, frame O


@dataclass(frozen=True)
class Wrench:
    """The raw force, and what is needed to take the tool from it.

    Attributes:
        time: Shape (S,) [s].
        raw: The wrench's frame, shape (S, 3) [N].
        load: Of the tool on the sensor, in the same frame, shape (S, 3); 0 where it is not known.
        turn: The wrench's frame into frame O, S rotations.
    """

    time: np.ndarray
    raw: np.ndarray
    load: np.ndarray
    turn: Rotation

    @classmethod
    def of(
        cls,
        t: np.ndarray,
        raw: np.ndarray,
        motion: Motion,
        geometry: Geometry,
        tool: object | None,
        release: float,
    ) -> Wrench:
        """At `release` [s] the hand may start back."""
        load = np.zeros_like(raw)
        if tool is not None:
            center = np.array(tool.center)
            load = tool.mass * load_per_mass(motion, geometry, t, center, jump=release)
        return cls(t, raw, load, sensor_turns(motion, geometry, t))


def sensor_turns(motion: Motion, geometry: Geometry, times: np.ndarray) -> Rotation:
    """The wrench's frame into frame O at times (T,): T rotations."""
    if geometry.sensor_is_fixed:
        return Rotation.from_quat(np.tile(geometry.sensor.rotation.as_quat(), (len(times), 1)))
    return motion.orientation(times) * geometry.sensor.rotation


def load_per_mass(
    motion: Motion,
    geometry: Geometry,
    times: np.ndarray,
    center: np.ndarray,
    *,
    gravity: np.ndarray = GRAVITY,
    jump: float | None = None,
) -> np.ndarray:
    """Force on the sensor of each kilogram of tool, gravity less acceleration [N/kg].

    Args:
        times: Shape (T,) [s].
        center: Of mass, in the wrench's frame [m], shape (3,); in the hand's frame where the
            wrench is given in one that does not move with the hand.
        gravity: Frame O [m/s^2]; 0 leaves the inertia alone.
        jump: When the acceleration may jump [s].

    Returns:
        Shape (T, 3), in the wrench's frame.
    """
    point = np.asarray(center) if geometry.sensor_is_fixed else geometry.sensor.apply(center)
    specific = gravity - motion.acceleration(times, point, jump)
    return sensor_turns(motion, geometry, times).inv().apply(specific)
