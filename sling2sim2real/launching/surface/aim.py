"""Aiming at a target: launches of a map over the box, and a root search along one draw's line."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sling2sim2real.launching.surface.landing_map import LandingMap

INSET = 2e-3  # m from the edge of the box, which leaves room for the root search
NEAR = 2e-4  # m of landing that count as a hit


def landings_within(landing_map: LandingMap, nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Draws of a grid of `nodes` a side within the box [m], and where they land by the map [m].

    Returns:
        Shapes (nodes, nodes, 2) and (nodes, nodes); NaN where the draw fails.
    """
    axes = [
        np.linspace(low + INSET, high - INSET, nodes)
        for low, high in zip(landing_map.low, landing_map.high, strict=True)
    ]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    return grid, landing_map(grid.reshape(-1, 2)).landing_y.reshape(nodes, nodes)


def secants(
    off: Callable[[float], float], first: float, slope: float, most: int
) -> tuple[float, float]:
    """The length by which a draw is to be multiplied, from 1, for a launch NEAR its target.

    Ends too where a launch does not land, or where a longer draw lands no further.

    Args:
        off: How far beyond the target the draw of a length lands [m]; NaN where it does not.
        first: That of length 1.
        slope: Its change with the length there, about.
        most: How many launches more.

    Returns:
        The length, and what `off` says of it.
    """
    length, gap = 1.0, first
    for _ in range(most):
        if not (abs(gap) > NEAR and slope > 0):
            break
        before, length = (length, gap), length - gap / slope
        gap = off(length)
        slope = (gap - before[1]) / (length - before[0])
    return length, gap
