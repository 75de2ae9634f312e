"""What the force sensor feels of its own tool: weight that turns with the hand, and inertia."""

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
        turn: The wrench's frame into frame O: one rotation, or S of them where the tool is known.
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
        orientation: Rotation,
        geometry: Geometry,
        tool: object | None,
        release: float,
    ) -> Wrench:
        """`orientation` is the hand's where it does not turn; at `release` it may start back."""
        if tool is not None:
            center = np.array(tool.center)
            load = tool.mass * load_per_mass(motion, geometry, t, center, release)
            return cls(t, raw, load, sensor_turns(motion, geometry, t))
        turn = geometry.sensor.rotation
        return cls(t, raw, 0 * raw, turn if geometry.sensor_is_fixed else orientation * turn)


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
    jump: float | None = None,
) -> np.ndarray:
    """Force on the sensor of each kilogram of tool, gravity less acceleration [N/kg].

    Args:
        times: Shape (T,) [s].
        center: Of mass, in the wrench's frame [m], shape (3,); in the hand's frame where the
            wrench is given in one that does not move with the hand.
        jump: When the acceleration may jump [s].

    Returns:
        Shape (T, 3), in the wrench's frame.
    """
    point = np.asarray(center) if geometry.sensor_is_fixed else geometry.sensor.apply(center)
    felt = GRAVITY - motion.acceleration(times, point, jump)
    return sensor_turns(motion, geometry, times).inv().apply(felt)
