"""Draws whose launch without errors lands on a target, found by root search in the world itself.

A target is met by a whole curve of draws. The oracle takes the one whose landing depends least on
where exactly the band is drawn: whatever a policy knows, it has no less error from a draw that is
off. The draw for a target that is out of reach is NaN.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sling2sim2real.launching.surface.aim import NEAR, landings_within, secants
from sling2sim2real.launching.surface.landing_map import LandingMap

Land = Callable[[np.ndarray], float]
"""Landing [m] of a launch from the draw (2,) without errors; NaN where there is none."""

FINE = 401  # nodes along y and z between which the map is searched
FIRST_STEP, LAUNCHES = 2e-3, 12  # of the root search: share of the draw's length, and how many


def sensitivity(landing_map: LandingMap, draws: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """Change of the landing with the draw, |dL/d(y, z)|, at draws (N, 2) [m], shape (N,)."""
    around = step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    landing = landing_map((draws[:, None] + around).reshape(-1, 2)).landing_y.reshape(-1, 4)
    return np.hypot(landing[:, 0] - landing[:, 1], landing[:, 2] - landing[:, 3]) / (2 * step)


def least_sensitive_draw(landing_map: LandingMap, target: float) -> np.ndarray:
    """Least sensitive of the draws that the map lands on `target` [m], shape (2,).

    NaN where the box, within the force limit, has none.
    """
    grid, landing = landings_within(landing_map, FINE)
    off = landing - target
    here = off[:-1, :-1]
    hits = grid[:-1, :-1][(here * off[1:, :-1] <= 0) | (here * off[:-1, 1:] <= 0)]
    sensitivities = sensitivity(landing_map, hits)
    return (
        hits[np.nanargmin(sensitivities)]
        if np.isfinite(sensitivities).any()
        else np.full(2, np.nan)
    )


def hit(land: Land, target: float, start: np.ndarray) -> np.ndarray:
    """The draw (2,) on the line from the fork through `start` (2,) that lands on `target` [m].

    Within NEAR, by secants. NaN where they do not come there.
    """
    start = np.asarray(start, float)

    def off(length: float) -> float:
        return land(length * start) - target

    first = off(1.0)
    length, left = secants(off, first, abs(first) / FIRST_STEP, LAUNCHES - 1)
    return length * start if abs(left) <= NEAR else np.full(2, np.nan)
