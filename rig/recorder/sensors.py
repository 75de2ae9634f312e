"""What the force sensor, the robot and the gripper report, with their flaws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rig.physics.robot import SENSOR_LEVER, Robot
from rig.physics.string import GRAVITY

if TYPE_CHECKING:
    from pipeline.params.virtual_rig import RigWrench
    from rig.recorder.interaction import Interaction

TOOL_CENTER = 0.4  # of the way from the sensor to the tool centre point


def wrench(
    happened: Interaction, robot: Robot, settings: RigWrench, rng: np.random.Generator
) -> np.ndarray:
    """Forces [N] and torques [N m] in the sensor's frame, shape (T, 6).

    The sensor carries the tool: its weight, and its inertia as the hand speeds up or swings back.
    """
    count = len(happened.force)
    lever = SENSOR_LEVER * robot.tool_axes[:, 2]
    tool = settings.tool_mass * (GRAVITY - happened.acceleration)
    force = robot.sensor.apply(happened.force + tool, inverse=True)
    torque = np.cross(lever, happened.force) + np.cross(TOOL_CENTER * lever, tool)
    torque = robot.sensor.apply(torque, inverse=True)
    bias, drift = settings.bias * direction(rng), settings.drift * direction(rng)
    force += bias + np.linspace(0, 1, count)[:, None] * drift
    force += rng.normal(0, settings.noise, force.shape)
    torque += rng.normal(0, settings.torque_noise, torque.shape)
    return np.hstack([force, torque])


def direction(rng: np.random.Generator) -> np.ndarray:
    """A random unit vector, shape (3,)."""
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)
