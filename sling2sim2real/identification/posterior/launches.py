"""The evidence of launches that a user measured: where the projectile landed from a draw, how fast.

    -2 log p = sum over launches of e' C^-1 e,   C = error^2 G G' + diag(sigma^2)

e are log y - log f(phi, draw) of what was measured: landing and exit speed as logarithms, its
angle as it is; f is simulated. sigma is the instrument's: of a tape measure, a chronograph, a
protractor. The draw's error moves all three of a launch, by the launch's gradient G in the draw.
So a speed tells apart a launch that loses energy from one that was aimed wrongly. What the law
gets wrong is common to a band's launches: that is the returned share, a coordinate of the density.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.launches_file import COLUMNS, FIT, LEFT, LaunchRow, number
from sling2sim2real.identification.posterior.expansion import Linearised
from sling2sim2real.simulator.launch import landing_gradient, launch
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters

TAPE = 0.01  # of a measured landing, standard deviation [m]
CHRONOGRAPH = 0.01  # of a measured speed, as a share; two pictures of 240 Hz are no better
PROTRACTOR = np.deg2rad(1.0)  # of a measured angle [rad]
MEASURED = ("landing", "speed", "angle")


@dataclass(frozen=True)
class Observed:
    """A launch: draw (y, z) and its standard deviation along each axis, and what was measured.

    The deviation is None where a table leaves it out. Landing [m], and speed [m/s] and angle [rad
    above the horizon] as the projectile left the pouch; None: not measured. Raises UserError: a
    value that none has, or neither landing nor speed.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float | None = None
    speed: float | None = None
    angle: float | None = None

    def __post_init__(self) -> None:
        angle = None if self.angle is None else np.rad2deg(self.angle)
        values = *self.draw, self.error, self.landing, self.speed, angle
        for name, value in zip((*COLUMNS[:4], *LEFT), values, strict=True):
            number("launch", name, "" if value is None else str(value))
        if self.landing is None and self.speed is None:
            raise UserError("launch: give its landing, its speed, or both")


def observed(rows: Sequence[LaunchRow], usual: float) -> list[Observed]:
    """Those launches of a table that are to fit.

    Args:
        usual: Standard deviation of a draw without one of its own [m].
    """
    return [
        Observed(
            row.draw,
            usual if row.error is None else row.error,
            row.landing,
            row.speed,
            None if row.angle is None else float(np.deg2rad(row.angle)),
        )
        for row in rows
        if row.use == FIT
    ]


@dataclass(frozen=True)
class Evidence:
    """Launches of one band, and what launches them."""

    launches: Sequence[Observed]
    setup: LaunchSetup


@dataclass(frozen=True)
class LaunchExpansion:
    """M measurements of launches around coordinates (D,), those of a launch one after the other.

    Attributes:
        off: Of each: log of measured over simulated landing or speed, measured less simulated angle
            [rad]; NaN where the simulated launch fails, or one from a draw beside it, shape (M,).
        slopes: Change of the simulated one with the coordinates, shape (D, M); 0 where a launch
            fails, and in a coordinate whose finite difference does.
        spread: Standard deviation of each, shape (M,).
        whitening: Lower triangular, (M, M): its product with `off` has the covariance 1.
        launch: Number of the launch of each, shape (M,).
    """

    off: np.ndarray
    slopes: np.ndarray
    spread: np.ndarray
    whitening: np.ndarray
    launch: np.ndarray

    @property
    def failed(self) -> np.ndarray:
        """Which measurements are of a launch that fails, shape (M,)."""
        return np.isnan(self.off)

    @property
    def gap(self) -> np.ndarray:
        """`off`, white, shape (M,)."""
        return np.where(self.failed, np.nan, self.whitening @ np.nan_to_num(self.off))

    @property
    def design(self) -> np.ndarray:
        """`slopes`, white, shape (D, M)."""
        return self.slopes @ self.whitening.T

    def of(self, which: np.ndarray) -> Linearised:
        """Evidence of all measurements of some launches, a mask (M,)."""
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
        measured: Landing, speed and angle of each launch, NaN where not measured, shape (N, 3).
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
        measured = [[getattr(launched, name) for name in MEASURED] for launched in observed]
        self.measured = np.array(measured, float).reshape(-1, len(MEASURED))
        first = setup.history.deepest if setup.history else 0.0
        seen = np.maximum.accumulate(np.append(first, np.linalg.norm(self.draws, axis=1)))
        self.deepest, self.after = seen[:-1], float(seen[-1])

    def expand(
        self, parameters_of: Callable[[np.ndarray], Parameters], phi: np.ndarray, steps: np.ndarray
    ) -> LaunchExpansion:
        """Expand around coordinates (D,) with finite differences `steps` (D,)."""
        around = parameters_of(phi + np.vstack([0 * steps, np.diag(steps)]))
        launches = np.arange(len(self.draws))
        here, gradient = landing_gradient(
            lambda draws: self._simulated(
                around[:1], draws, launches.repeat(len(draws) // len(launches))
            ),
            self.draws,
        )
        count = len(steps)
        moved = self._simulated(
            around[np.repeat(1 + np.arange(count), len(self.draws))],
            np.tile(self.draws, (count, 1)),
            np.tile(launches, count),
        ).reshape(count, *here.shape)
        launch, what = np.nonzero(~np.isnan(self.measured))
        off = (_seen(self.measured) - here)[launch, what]
        slopes = ((moved - here) / steps[:, None, None])[:, launch, what]
        instrument = np.broadcast_to([np.nan, CHRONOGRAPH, PROTRACTOR], here.shape).copy()
        instrument[:, 0] = TAPE / self.measured[:, 0]
        by_draw = self.errors[:, None, None] * gradient  # (N, 3, 2)
        covariances = [
            by_draw[i][mine] @ by_draw[i][mine].T + np.diag(instrument[i][mine] ** 2)
            for i, mine in enumerate(~np.isnan(self.measured))
        ]
        fails = ~np.array([np.isfinite(covariance).all() for covariance in covariances])
        off[~np.isfinite(off) | fails[launch]] = np.nan
        slopes[~np.isfinite(slopes)] = 0.0
        roots = [
            np.eye(len(of)) if fail else np.linalg.inv(np.linalg.cholesky(of))
            for of, fail in zip(covariances, fails, strict=True)
        ]
        spread = np.sqrt(np.concatenate([np.diag(of) for of in covariances]))
        return LaunchExpansion(off, slopes, spread, np.asarray(block_diag(*roots)), launch)

    def remaining(self, parameters: Parameters, expansion: LaunchExpansion) -> np.ndarray:
        """What M parameters leave of the measurements, white, shape (M, Q).

        NaN where a simulation fails; of the Q measurements that do not fail at the expansion.
        """
        count, launches, good = len(parameters), len(self.draws), ~expansion.failed
        each = parameters[np.repeat(np.arange(count), launches)]
        simulated = self._simulated(
            each, np.tile(self.draws, (count, 1)), np.tile(np.arange(launches), count)
        ).reshape(count, launches, -1)
        off = (_seen(self.measured) - simulated)[:, ~np.isnan(self.measured)][:, good]
        return off @ expansion.whitening[np.ix_(good, good)].T

    def _simulated(
        self, parameters: Parameters, draws: np.ndarray, number: np.ndarray
    ) -> np.ndarray:
        """Landings, speeds and angles of N parameters from draws (N, 2), as `_seen`, shape (N, 3).

        NaN where a launch fails.

        Args:
            number: Of the launch whose history each has, shape (N,).
        """
        setup, history = self.setup, self.setup.history
        if history:
            setup = replace(setup, history=replace(history, deepest=self.deepest[number]))
        launched = launch(self.sling, setup, parameters, draws, workers=self.workers)
        failed = np.array([why is not None for why in launched.failure])
        outcome = np.stack([launched.landing_y, launched.speed, launched.angle], axis=1)
        return _seen(np.where(failed[:, None], np.nan, outcome))


def _seen(outcome: np.ndarray) -> np.ndarray:
    """Landings, speeds and angles (N, 3) as the density has them: the first two as logarithms."""
    return np.column_stack([np.log(outcome[:, :2]), outcome[:, 2]])
