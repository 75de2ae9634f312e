"""A slingshot with a closed form.

A linear spring gives all its energy to a projectile that leaves at the origin, along the line of
the draw, and falls freely to the floor.
"""

from types import SimpleNamespace

import numpy as np

STIFFNESS, MASS, GRAVITY = 24.0, 0.0565, 9.81
FORK_WIDTH, FORK_HEIGHT, REST_LENGTH = 0.275, 0.52, 0.52
DRAW_Y, DRAW_Z = (-0.45, -0.25), (-0.30, -0.10)
START = (0.0, -0.22)  # of the projectile


def launch(draws: np.ndarray) -> SimpleNamespace:
    """Landing, holding force and failure of draws (N, 2), from the formulas."""
    distance = np.hypot(*draws.T)
    length = 2 * np.hypot(FORK_WIDTH / 2, distance)
    stretch = length - REST_LENGTH
    speed = stretch * np.sqrt(STIFFNESS / MASS)
    across, up = speed * -draws[:, 0] / distance, speed * -draws[:, 1] / distance
    flight = (up + np.sqrt(up**2 + 2 * GRAVITY * FORK_HEIGHT)) / GRAVITY
    force = 4 * STIFFNESS * stretch * distance / length
    return SimpleNamespace(landing_y=across * flight, hold_force=force, failure=[None] * len(draws))


def broken(draws: np.ndarray, thetas: np.ndarray | None = None) -> SimpleNamespace:
    """Nothing lands."""
    nan, reasons = np.full(len(draws), np.nan), ["the simulation did not converge"] * len(draws)
    return SimpleNamespace(landing_y=nan, hold_force=nan, failure=reasons)
