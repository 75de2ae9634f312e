"""The evidence of launches that a user measured: where the projectile landed from a draw.

    -2 log p = sum over launches of ((log y - log f(phi, draw)) / sigma)^2

f is the simulated landing. sigma is each launch's own: what the error of its draw moves the
landing by, and the tape measure's. What the law gets wrong is common to a band's launches: that is
the returned share, a coordinate of the density.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pipeline.simulator.launch import landing_gradient, launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import Parameters

TAPE = 0.01  # of a measured landing, standard deviation [m]


@dataclass(frozen=True)
class Observed:
    """A launch: draw (y, z) and its standard deviation along each axis, landing [m].

    The deviation is None where a table leaves it out.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float


@dataclass(frozen=True)
class Evidence:
    """Launches of one band, and what launches them.

    Attributes:
        made_with: The settings that `setup` comes from, by their keys in params.yaml.
    """

    launches: Sequence[Observed]
    setup: LaunchSetup
    made_with: Mapping[str, float | None] = field(default_factory=dict)


class LaunchLikelihood:
    """Launches of one band.

    Attributes:
        setup: With the history that the launches had.
        left: Of each, log of measured over simulated landing at the last expansion; NaN where the
            simulated launch fails, which then counts for nothing.
    """

    def __init__(
        self, observed: Sequence[Observed], sling: ClampedBand, setup: LaunchSetup
    ) -> None:
        self.sling, self.setup = sling, setup
        self.draws = np.array([one.draw for one in observed], float).reshape(-1, 2)
        self.errors = np.array([one.error for one in observed], float)
        self.landings = np.array([one.landing for one in observed], float)
        self.left = np.full(len(self.draws), np.nan)

    def expand(
        self, parameters_of: Callable[[np.ndarray], Parameters], phi: np.ndarray, steps: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Misfit, Hessian (D, D) and gradient (D,) at coordinates (D,), as of an `Expansion`."""
        around = parameters_of(phi + np.vstack([0 * steps, np.diag(steps)]))
        here, gradient = landing_gradient(
            lambda draws: self._simulated(around[:1], draws), self.draws
        )
        slope = np.linalg.norm(gradient, axis=1)
        count = len(steps)
        moved = self._simulated(
            around[np.repeat(1 + np.arange(count), len(self.draws))],
            np.tile(self.draws, (count, 1)),
        ).reshape(count, -1)
        self.left = np.log(self.landings / here)
        changes = (np.log(moved) - np.log(here)) / steps[:, None]  # (D, N)
        spread = np.hypot(slope * self.errors / here, TAPE / self.landings)
        good = np.isfinite(self.left + spread + changes.sum(axis=0))
        design = changes[:, good] / spread[good]
        gap = self.left[good] / spread[good]
        return float(gap @ gap), design @ design.T, design @ gap

    def _simulated(self, parameters: Parameters, draws: np.ndarray) -> np.ndarray:
        """Landings [m] of N parameters from draws (N, 2), NaN where a launch fails."""
        done = launch(self.sling, self.setup, parameters, draws, workers=2)
        failed = np.array([why is not None for why in done.failure])
        return np.where(failed, np.nan, done.landing_y)
