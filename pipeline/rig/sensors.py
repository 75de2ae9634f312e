"""What the force sensor, the robot and the gripper report, with their flaws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pipeline.rig.robot import SENSOR_LEVER, Robot
from pipeline.rig.string import GRAVITY

if TYPE_CHECKING:
    from pipeline.params import RigWrench


def wrench(
    band_force: np.ndarray, robot: Robot, settings: RigWrench, rng: np.random.Generator
) -> np.ndarray:
    """Forces [N] and torques [N m] in the sensor's frame, shape (T, 6).

    Args:
        band_force: Of the band on the gripper, frame O, shape (T, 3).
    """
    count = len(band_force)
    lever = SENSOR_LEVER * robot.tool_axes[:, 2]
    force = robot.sensor.apply(band_force + settings.tool_mass * GRAVITY, inverse=True)
    torque = robot.sensor.apply(np.cross(lever, band_force), inverse=True)
    bias, drift = settings.bias * direction(rng), settings.drift * direction(rng)
    force += bias + np.linspace(0, 1, count)[:, None] * drift
    force += rng.normal(0, settings.noise, force.shape)
    torque += rng.normal(0, settings.torque_noise, torque.shape)
    return np.hstack([force, torque])


def direction(rng: np.random.Generator) -> np.ndarray:
    """A random unit vector, shape (3,)."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
