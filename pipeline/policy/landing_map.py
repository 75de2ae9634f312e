"""Landing map: where a launch lands as a smooth function of the draw, for one θ.

For a fixed θ the landing depends on the draw (y, z) alone, and smoothly. So a grid of launches is
simulated once, in one batch, and cubic splines read between them: training then asks for a million
launches in seconds, and the error of reading between is itself measured on random draws.

A draw is a failure, and not interpolated, where the interpolated holding force exceeds the limit
of the arm or where a corner of its grid cell failed in simulation.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy.interpolate import RBFInterpolator, RectBivariateSpline

from pipeline.files import replacing

TOO_MUCH_FORCE = "holding force above the limit"
OUTSIDE = "draw outside the box"
NO_FAILURE = ""

# draws (N, 2) [m] -> object with landing_y (N,) [m], hold_force (N,) [N], failure list[str | None]
Launcher = Callable[[np.ndarray], object]


@dataclass(frozen=True)
class Landings:
    """What a set of draws leads to.

    Attributes:
        landing_y: Landing on the floor [m], NaN where failed, shape (N,).
        hold_force: Force that the hand holds before the release [N], shape (N,).
        failure: Index into `LandingMap.reasons`, 0 where the launch succeeds, shape (N,).
    """

    landing_y: np.ndarray
    hold_force: np.ndarray
    failure: np.ndarray


@dataclass(frozen=True)
class LandingMap:
    """Launches over a grid of draws, and cubic splines between them.

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
        """Simulate a grid of `size` draws over the box, and `checks` random ones, in one batch.

        Args:
            launcher: Simulates draws, shape (N, 2) [m], without a force limit of its own.
            draw_y, draw_z: Bounds of the box [m].
            size: Number of nodes along y and z.
            max_force: Limit of the holding force [N].
            checks: Number of random draws that validate the interpolation.
            seed: Seed of those draws.
        """
        grid_y, grid_z = np.linspace(*draw_y, size[0]), np.linspace(*draw_z, size[1])
        nodes = np.stack(np.meshgrid(grid_y, grid_z, indexing="ij"), -1).reshape(-1, 2)
        low, high = np.array([draw_y, draw_z]).T
        random = np.random.default_rng(seed).uniform(low, high, (checks, 2))
        launched = launcher(np.concatenate([nodes, random]))
        failure = np.array([reason or NO_FAILURE for reason in launched.failure], object)
        landing = np.where(failure == NO_FAILURE, launched.landing_y, np.nan)
        force = np.asarray(launched.hold_force, float)
        on_grid = slice(len(nodes))
        return cls(
            draw_y=grid_y,
            draw_z=grid_z,
            landing_y=landing[on_grid].reshape(size),
            hold_force=force[on_grid].reshape(size),
            failure=failure[on_grid].reshape(size),
            max_force=float(max_force),
            checks=np.column_stack([random, landing[len(nodes) :], force[len(nodes) :]]),
        )

    @cached_property
    def reasons(self) -> list[str]:
        """Names of the failure codes; code 0 is success."""
        return [NO_FAILURE, TOO_MUCH_FORCE, OUTSIDE, *sorted(set(self.failure.flat) - {NO_FAILURE})]

    def __call__(self, draws: np.ndarray) -> Landings:
        """Landings of draws, shape (N, 2) [m], read off the splines."""
        draws = np.asarray(draws, float)
        force = self._force_spline.ev(draws[:, 0], draws[:, 1])
        landing = self._landing_spline.ev(draws[:, 0], draws[:, 1])
        row = np.clip(np.searchsorted(self.draw_y, draws[:, 0]) - 1, 0, len(self.draw_y) - 2)
        column = np.clip(np.searchsorted(self.draw_z, draws[:, 1]) - 1, 0, len(self.draw_z) - 2)
        failure = self._cell_failure[row, column]
        failure = np.where((failure == 0) & (force > self.max_force), 1, failure)
        low = np.array([self.draw_y[0], self.draw_z[0]])
        high = np.array([self.draw_y[-1], self.draw_z[-1]])
        tolerance = 1e-6  # float32 draws at the edge of the box
        outside = ((draws < low - tolerance) | (draws > high + tolerance)).any(1)
        failure = np.where(outside, 2, failure)
        return Landings(np.where(failure > 0, np.nan, landing), force, failure)

    def validation(self, targets: tuple[float, float]) -> dict:
        """Interpolation error [m] on the random draws: over the box, and where targets lie."""
        predicted = self(self.checks[:, :2]).landing_y
        simulated = self.checks[:, 2]
        error = np.abs(predicted - simulated)
        known = np.isfinite(error)
        near = known & (simulated >= targets[0]) & (simulated <= targets[1])

        def summary(chosen: np.ndarray) -> dict:
            if not chosen.any():
                return {"draws": 0, "mean_error_m": None, "max_error_m": None}
            return {
                "draws": int(chosen.sum()),
                "mean_error_m": float(error[chosen].mean()),
                "max_error_m": float(error[chosen].max()),
            }

        return {"box": summary(known), "target_range": summary(near)}

    def save(self, path: Path, header: dict | None = None) -> None:
        """Write one row a launch: grid nodes first (y slowest), then the validation draws."""
        y, z = np.meshgrid(self.draw_y, self.draw_z, indexing="ij")
        kind = ["grid"] * y.size + ["validation"] * len(self.checks)
        failure = [reason or None for reason in self.failure.ravel()]
        columns = {
            "kind": pa.array(kind, pa.string()),
            "draw_y": np.append(y, self.checks[:, 0]),
            "draw_z": np.append(z, self.checks[:, 1]),
            "landing_y": np.append(self.landing_y, self.checks[:, 2]),
            "hold_force": np.append(self.hold_force, self.checks[:, 3]),
            "failure": pa.array(failure + [None] * len(self.checks), pa.string()),
        }
        content = {"max_force": self.max_force, **(header or {})}
        metadata = {"landing_map": json.dumps(content, sort_keys=True)}
        with replacing(path) as temporary:
            pq.write_table(pa.table(columns).replace_schema_metadata(metadata), temporary)

    @classmethod
    def load(cls, path: Path) -> LandingMap:
        """Read a map that `save` wrote. Raises FileNotFoundError."""
        table = pq.read_table(path)
        header = json.loads(table.schema.metadata[b"landing_map"])
        kind = np.array(table["kind"].to_pylist())
        column = {
            name: table[name].to_numpy() for name in ("draw_y", "draw_z", "landing_y", "hold_force")
        }
        grid, check = kind == "grid", kind == "validation"
        draw_y, draw_z = (np.unique(column[name][grid]) for name in ("draw_y", "draw_z"))
        shape = (len(draw_y), len(draw_z))
        failure = np.array(
            [reason or NO_FAILURE for reason in table["failure"].to_pylist()], object
        )
        return cls(
            draw_y=draw_y,
            draw_z=draw_z,
            landing_y=column["landing_y"][grid].reshape(shape),
            hold_force=column["hold_force"][grid].reshape(shape),
            failure=failure[grid].reshape(shape),
            max_force=header["max_force"],
            checks=np.column_stack([values[check] for values in column.values()]),
        )

    @cached_property
    def _cell_failure(self) -> np.ndarray:
        """Failure code of each cell of the grid, shape (Y - 1, Z - 1): a failed corner fails it."""
        codes = np.vectorize(self.reasons.index, otypes=[int])(self.failure)
        return np.max([codes[:-1, :-1], codes[1:, :-1], codes[:-1, 1:], codes[1:, 1:]], axis=0)

    @cached_property
    def _landing_spline(self) -> RectBivariateSpline:
        return self._spline(self.landing_y)

    @cached_property
    def _force_spline(self) -> RectBivariateSpline:
        return self._spline(self.hold_force)

    def _spline(self, values: np.ndarray) -> RectBivariateSpline:
        """Interpolating bicubic spline. Failed nodes are filled by a smooth continuation, so that
        they do not disturb their neighbours; no answer is read from a cell that they touch.
        """
        known = np.isfinite(values)
        if not known.any():
            values = np.zeros(values.shape)
        elif not known.all():
            nodes = np.stack(np.indices(values.shape), -1).astype(float)
            continuation = RBFInterpolator(
                nodes[known], values[known], neighbors=min(24, int(known.sum())), kernel="linear"
            )
            values = values.copy()
            values[~known] = continuation(nodes[~known])
        return RectBivariateSpline(self.draw_y, self.draw_z, values)
