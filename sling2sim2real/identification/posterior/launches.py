"""The evidence of launches that a user measured: where the projectile landed from a draw.

    -2 log p = sum over launches of ((log y - log f(phi, draw)) / sigma)^2

f is the simulated landing. sigma is each launch's own: what the error of its draw moves the
landing by, and the tape measure's. What the law gets wrong is common to a band's launches: that is
the returned share, a coordinate of the density.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from sling2sim2real.base.launches_file import COLUMNS, FIT, LaunchRow, metres
from sling2sim2real.identification.posterior.expansion import Linearised
from sling2sim2real.simulator.launch import landing_gradient, launch
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters

TAPE = 0.01  # of a measured landing, standard deviation [m]


@dataclass(frozen=True)
class Observed:
    """A launch: draw (y, z) and its standard deviation along each axis, landing [m].

    The deviation is None where a table leaves it out. Raises UserError: a value that none has.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float

    def __post_init__(self) -> None:
        values = *self.draw, self.error, self.landing
        for name, value in zip(COLUMNS[:4], values, strict=True):
            metres("launch", name, "" if value is None else str(value))


def observed(rows: Sequence[LaunchRow], usual: float) -> list[Observed]:
    """Those launches of a table that are to fit.

    Args:
        usual: Standard deviation of a draw without one of its own [m].
    """
    return [
        Observed(row.draw, usual if row.error is None else row.error, row.landing)
        for row in rows
        if row.use == FIT and row.landing is not None
    ]


@dataclass(frozen=True)
class Evidence:
    """Launches of one band, and what launches them."""

    launches: Sequence[Observed]
    setup: LaunchSetup


@dataclass(frozen=True)
class LaunchExpansion:
    """N launches around coordinates (D,).

    Attributes:
        log_ratio: Of each, log of measured over simulated landing; NaN where the simulated launch
            fails, or one from a draw beside it, shape (N,).
        spread: Standard deviation of that logarithm, shape (N,).
        design: Change of the simulated landing's logarithm with the coordinates, over the spread,
            shape (D, N); 0 where a launch fails, and in a coordinate whose finite difference does.
    """

    log_ratio: np.ndarray
    spread: np.ndarray
    design: np.ndarray

    @property
    def failed(self) -> np.ndarray:
        """Which launches fail, shape (N,)."""
        return np.isnan(self.log_ratio)

    @property
    def gap(self) -> np.ndarray:
        """`log_ratio` over the spread, shape (N,)."""
        return self.log_ratio / self.spread

    def of(self, which: np.ndarray) -> Linearised:
        """Evidence of some launches, a mask (N,)."""
        count = np.count_nonzero(which)
        slopes = -self.design[:, which].T
        return Linearised(self.gap[which], slopes, np.zeros((count, 0)), np.zeros(count))

    @cached_property
    def landed(self) -> Linearised:
        """Evidence of those that do not fail."""
        return self.of(~self.failed)


class LaunchLikelihood:
    """Launches of one band.

    Attributes:
        setup: With the history that the first launch had.
        deepest: What the band had seen before each launch [m], of a law with memory, shape (N,): as
            the history says, or an earlier launch. Rubber softens up to its largest stretch.
        after: The same after all of them.
    """

    def __init__(
        self,
        observed: Sequence[Observed],
        sling: ClampedBand,
        setup: LaunchSetup,
        workers: int = 1,
    ) -> None:
        """Keep the launches; `workers` are threads, which change no result."""
        self.sling, self.setup, self.workers = sling, setup, workers
        self.draws = np.array([launched.draw for launched in observed], float).reshape(-1, 2)
        self.errors = np.array([launched.error for launched in observed], float)
        self.landings = np.array([launched.landing for launched in observed], float)
        first = setup.history.deepest if setup.history else 0.0
        seen = np.maximum.accumulate(np.append(first, np.linalg.norm(self.draws, axis=1)))
        self.deepest, self.after = seen[:-1], float(seen[-1])

    def expand(
        self, parameters_of: Callable[[np.ndarray], Parameters], phi: np.ndarray, steps: np.ndarray
    ) -> LaunchExpansion:
        """Expand around coordinates (D,) with finite differences `steps` (D,)."""
        around = parameters_of(phi + np.vstack([0 * steps, np.diag(steps)]))
        number = np.arange(len(self.draws))
        here, gradient = landing_gradient(
            lambda draws: self._simulated(
                around[:1], draws, number.repeat(len(draws) // len(number))
            ),
            self.draws,
        )
        slope = np.linalg.norm(gradient, axis=1)
        count = len(steps)
        moved = self._simulated(
            around[np.repeat(1 + np.arange(count), len(self.draws))],
            np.tile(self.draws, (count, 1)),
            np.tile(number, count),
        ).reshape(count, -1)
        log_ratio = np.log(self.landings / here)
        changes = (np.log(moved) - np.log(here)) / steps[:, None]  # (D, N)
        spread = np.hypot(slope * self.errors / here, TAPE / self.landings)
        design = changes / spread
        log_ratio[~np.isfinite(log_ratio / spread)] = np.nan
        design[~np.isfinite(design)] = 0.0
        return LaunchExpansion(log_ratio, spread, design)

    def remaining(self, parameters: Parameters, expansion: LaunchExpansion) -> np.ndarray:
        """Logs of measured over simulated landings of M parameters, over the spread: (M, N).

        NaN where a simulation fails; of the launches that do not fail at the expansion.
        """
        good = np.flatnonzero(~expansion.failed)
        count = len(parameters)
        number = np.tile(good, count)
        each = parameters[np.repeat(np.arange(count), len(good))]
        landed = self._simulated(each, self.draws[number], number).reshape(count, -1)
        return np.log(self.landings[good] / landed) / expansion.spread[good]

    def _simulated(
        self, parameters: Parameters, draws: np.ndarray, number: np.ndarray
    ) -> np.ndarray:
        """Landings [m] of N parameters from draws (N, 2), NaN where a launch fails.

        Args:
            number: Of the launch whose history each has, shape (N,).
        """
        setup, history = self.setup, self.setup.history
        if history:
            setup = replace(setup, history=replace(history, deepest=self.deepest[number]))
        launched = launch(self.sling, setup, parameters, draws, workers=self.workers)
        failed = np.array([why is not None for why in launched.failure])
        return np.where(failed, np.nan, launched.landing_y)
