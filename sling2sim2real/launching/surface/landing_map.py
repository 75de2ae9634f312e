"""Landing map: launches over a grid of draws, simulated in one batch for one θ, and what is read
between them.

For a fixed θ the landing depends on the draw (y, z) alone, and smoothly. So a grid of launches is
simulated once, and cubic splines read between them: training then asks for a million launches in
seconds. What the policy is worth that comes of it, simulated launches of its own say.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import NdBSpline, RBFInterpolator, make_interp_spline

TOO_MUCH_FORCE = "holding force above the limit"
OUTSIDE = "draw outside the box"
NO_FAILURE = ""
# Of draws (N, 2) [m], without a force limit of its own; gives landings `landing_y` (N,) [m], NaN
# where failed, `hold_force` (N,) [N] before the release, and `failure`, length N: None or why.
Launcher = Callable[..., Any]


@dataclass(frozen=True)
class Landings:
    """What draws lead to, shapes (N,).

    Attributes:
        landing_y: Landing on the floor [m], NaN where failed.
        hold_force: Force that the hand holds before the release [N].
        failure: Index into `LandingMap.reasons`, 0 where the launch succeeds.
    """

    landing_y: np.ndarray
    hold_force: np.ndarray
    failure: np.ndarray


class LandingMap:
    """Landings of draws.

    A draw is a failure, and not interpolated, where the interpolated holding force exceeds the
    arm's limit or where a corner of its grid cell failed in simulation.

    Attributes:
        reasons: Names of the failure codes; code 0 is success.
        low, high: Corners of the box of draws [m], shape (2,).
    """

    def __init__(
        self,
        grid: tuple[np.ndarray, np.ndarray],
        landing_y: np.ndarray,
        hold_force: np.ndarray,
        failure: np.ndarray,
        max_force: float,
    ) -> None:
        """Read between launches of a grid.

        Args:
            grid: Draws along y (Y,) and along z (Z,) [m], ascending.
            landing_y: Landings [m], NaN where failed, shape (Y, Z).
            hold_force: Of the drawn band [N], NaN where the simulation failed, shape (Y, Z).
            failure: Reasons, NO_FAILURE where none, shape (Y, Z).
            max_force: The arm may hold no more [N].
        """
        self.grid, self.max_force = grid, max_force
        self.low, self.high = (np.array([axis[end] for axis in grid]) for end in (0, -1))
        failures = sorted(set(failure.flat) - {NO_FAILURE})
        self.reasons = [NO_FAILURE, TOO_MUCH_FORCE, OUTSIDE, *failures]
        code = np.vectorize(self.reasons.index, otypes=[int])(failure)
        self._cell = np.max([code[:-1, :-1], code[1:, :-1], code[:-1, 1:], code[1:, 1:]], axis=0)
        self._landing, self._force = self._spline(landing_y), self._spline(hold_force)

    @classmethod
    def simulate(
        cls,
        launcher: Launcher,
        *,
        draw_y: tuple[float, float],
        draw_z: tuple[float, float],
        size: tuple[int, int],
        max_force: float,
    ) -> LandingMap:
        """Launch a grid.

        Args:
            launcher: Simulates draws, shape (N, 2) [m].
            draw_y, draw_z: Bounds of the box [m].
            size: Number of nodes along y and z, at least 4.
            max_force: The arm may hold no more [N].
        """
        grid = np.linspace(*draw_y, size[0]), np.linspace(*draw_z, size[1])
        launched = launcher(np.stack(np.meshgrid(*grid, indexing="ij"), -1).reshape(-1, 2))
        failure = np.array([reason or NO_FAILURE for reason in launched.failure], object)
        landing = np.where(failure == NO_FAILURE, launched.landing_y, np.nan)
        force = np.asarray(launched.hold_force, float)
        landing, force, failure = (values.reshape(size) for values in (landing, force, failure))
        return cls(grid, landing, force, failure, float(max_force))

    def __call__(self, draws: np.ndarray) -> Landings:
        """Landings of draws, shape (N, 2) [m]."""
        draws = np.asarray(draws, float)
        outside = ((draws < self.low - 1e-6) | (draws > self.high + 1e-6)).any(1)  # float32 draws
        inside = np.clip(draws, self.low, self.high)
        cell = [
            np.clip(np.searchsorted(axis, along) - 1, 0, len(axis) - 2)
            for axis, along in zip(self.grid, inside.T, strict=True)
        ]
        landing, force = self._landing(inside), self._force(inside)
        failure = self._cell[*cell]
        failure = np.where((failure == 0) & (force > self.max_force), 1, failure)
        failure = np.where(outside, 2, failure)
        return Landings(np.where(failure > 0, np.nan, landing), force, failure)

    def _spline(self, values: np.ndarray) -> NdBSpline:
        """Interpolating bicubic splines through values (Y, Z)."""
        along_y = make_interp_spline(self.grid[0], _continued(values))
        along_z = make_interp_spline(self.grid[1], np.moveaxis(along_y.c, 1, 0))
        coefficients = np.ascontiguousarray(np.moveaxis(along_z.c, 0, 1))
        return NdBSpline((along_y.t, along_z.t), coefficients, 3)


def _continued(values: np.ndarray) -> np.ndarray:
    """Failed nodes filled by a smooth continuation, so that they do not disturb their neighbours;
    no answer is read from a cell that they touch.
    """
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros(values.shape)
    if finite.all():
        return values
    nodes = np.stack(list(np.indices(values.shape)), -1).astype(float)
    continuation = RBFInterpolator(
        nodes[finite], values[finite], neighbors=min(24, int(finite.sum())), kernel="linear"
    )
    filled = values.copy()
    filled[~finite] = continuation(nodes[~finite])
    return filled
