"""The way of a projectile after it has left the pouch."""

from __future__ import annotations

import numpy as np

from sling2sim2real.simulator.model import GRAVITY

POINTS = 40


def flight(
    y: float, z: float, speed: float, angle: float, floor: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places y and z [m], shape (POINTS,) each, without air, from where it leaves to the floor.

    Args:
        y, z, speed, angle: As it leaves [m, m/s, rad above the horizon].
        floor: Height z of the floor [m].
    """
    vy, vz = speed * np.cos(angle), speed * np.sin(angle)
    time = np.linspace(0, (vz + np.sqrt(vz**2 + 2 * GRAVITY * (z - floor))) / GRAVITY, POINTS)
    return y + vy * time, z + vz * time - GRAVITY * time**2 / 2
