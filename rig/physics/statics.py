"""Where a taut band rests that is held in the middle: Newton's method on its forces."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import solve_banded

REACH = 8  # from the first of a node's x to the last of the node after next, which it feels
NUDGE = 1e-7  # m, of the difference quotients
STEPS, SHORTEST = 40, 1e-3  # of Newton's method, and the least part of one


def balanced(
    forces: Callable[[np.ndarray], np.ndarray], x: np.ndarray, held: list[int], tolerance: float
) -> np.ndarray | None:
    """Nodes (nodes, 3) that no force moves, those that are held as they are.

    Args:
        forces: Of nodes (nodes, 3) [N], of the same shape.
        x: Places near there, shape (nodes, 3).
        held: Numbers of the nodes that stay.
        tolerance: Of the nodes [m].

    Returns:
        None where Newton's method does not come there, as for a slack band.
    """
    size, colours = x.size, 2 * REACH + 1  # columns of one colour share no row
    fixed = np.zeros(x.shape, bool)
    fixed[held] = True
    columns = np.arange(size)
    rows = columns + np.arange(-REACH, REACH + 1)[:, None]
    inside = (rows >= 0) & (rows < size)

    def pull(x: np.ndarray) -> np.ndarray:
        return np.where(fixed, 0.0, forces(x)).ravel()

    force = pull(x)
    for _ in range(STEPS):
        change = np.empty((size, colours))
        for colour in range(colours):
            moved = x.copy()
            moved.reshape(-1)[colour::colours] += NUDGE
            change[:, colour] = (pull(moved) - force) / NUDGE
        jacobian = np.where(inside, change[rows.clip(0, size - 1), columns % colours], 0.0)
        jacobian[REACH, fixed.ravel()] = 1.0
        step = -solve_banded((REACH, REACH), jacobian, force).reshape(x.shape)
        if np.abs(step).max() < tolerance:
            return x + step
        part = 1.0
        while not np.abs(trial := pull(x + part * step)).max() < np.abs(force).max():
            part /= 2
            if part < SHORTEST:
                return None
        x, force = x + part * step, trial
    return None
