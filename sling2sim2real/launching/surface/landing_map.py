"""Landing map: launches over a grid of draws, simulated in one batch, for one θ.

For a fixed θ the landing depends on the draw (y, z) alone, and smoothly. So a grid of launches is
simulated once, and cubic splines read between them (response_surface.py): training then asks for a
million launches in seconds, and the error of reading between is itself measured on random draws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sling2sim2real.launching.surface.response_surface import NO_FAILURE, Landings, ResponseSurface

# Of draws (N, 2) [m], without a force limit of its own; gives landings `landing_y` (N,) [m], NaN
# where failed, `hold_force` (N,) [N] before the release, and `failure`, length N: None or why.
Launcher = Callable[..., Any]


@dataclass(frozen=True)
class LandingMap:
    """Launches over a grid of draws, and what is read between them.

    Attributes:
        draw_y: Grid along y [m], ascending, shape (Y,), at least 4.
        draw_z: Grid along z [m], ascending, shape (Z,), at least 4.
        landing_y: Simulated landings [m], NaN where failed, shape (Y, Z).
        hold_force: Simulated holding force [N], NaN where the simulation failed, shape (Y, Z).
        failure: Reason of each node, "" where none, shape (Y, Z).
        max_force: The arm may hold no more [N].
        checks: Random draws that were simulated to validate the map: columns draw_y, draw_z,
            landing_y, hold_force [m, m, m, N], NaN where failed, shape (C, 4).
    """

    draw_y: np.ndarray
    draw_z: np.ndarray
    landing_y: np.ndarray
    hold_force: np.ndarray
    failure: np.ndarray
    max_force: float
    checks: np.ndarray

    @classmethod
    def simulate(
        cls,
        launcher: Launcher,
        *,
        draw_y: tuple[float, float],
        draw_z: tuple[float, float],
        size: tuple[int, int],
        max_force: float,
        checks: int = 128,
        seed: int = 0,
    ) -> LandingMap:
        """A grid and random draws, all in one batch.

        Args:
            launcher: Simulates draws, shape (N, 2) [m], without a force limit of its own.
            draw_y, draw_z: Bounds of the box [m].
            size: Number of nodes along y and z.
            max_force: Limit of the holding force [N].
            checks: Number of random draws that validate the interpolation.
            seed: Seed of those draws.
        """
        grid_y, grid_z = np.linspace(*draw_y, size[0]), np.linspace(*draw_z, size[1])
        low, high = np.array([draw_y, draw_z]).T
        random = np.random.default_rng(seed).uniform(low, high, (checks, 2))
        nodes = np.stack(np.meshgrid(grid_y, grid_z, indexing="ij"), -1).reshape(-1, 2)  # y slowest
        launched = launcher(np.concatenate([nodes, random]))
        failure = np.array([reason or NO_FAILURE for reason in launched.failure], object)
        landing = np.where(failure == NO_FAILURE, launched.landing_y, np.nan)
        force = np.asarray(launched.hold_force, float)
        count = len(nodes)
        return cls(
            draw_y=grid_y,
            draw_z=grid_z,
            landing_y=landing[:count].reshape(size),
            hold_force=force[:count].reshape(size),
            failure=failure[:count].reshape(size),
            max_force=float(max_force),
            checks=np.column_stack([random, landing[count:], force[count:]]),
        )

    def __call__(self, draws: np.ndarray) -> Landings:
        """Landings of draws, shape (N, 2) [m], read off the splines."""
        return self.surface(draws)

    @cached_property
    def surface(self) -> ResponseSurface:
        """What is read between the launches."""
        values = self.landing_y, self.hold_force, self.failure
        return ResponseSurface((self.draw_y, self.draw_z), *values, self.max_force)


def validation(landing_map: LandingMap, targets: tuple[float, float]) -> dict:
    """Interpolation error [m] on a map's random draws: over the box, and where targets lie."""
    simulated = landing_map.checks[:, 2]
    error = np.abs(landing_map(landing_map.checks[:, :2]).landing_y - simulated)
    finite = np.isfinite(error)
    near = finite & (simulated >= targets[0]) & (simulated <= targets[1])

    def summary(chosen: np.ndarray) -> dict:
        if not chosen.any():
            return {"draws": 0, "mean_error_m": None, "max_error_m": None}
        return {
            "draws": int(chosen.sum()),
            "mean_error_m": float(error[chosen].mean()),
            "max_error_m": float(error[chosen].max()),
        }

    return {"box": summary(finite), "target_range": summary(near)}
