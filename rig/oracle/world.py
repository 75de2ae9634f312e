"""The world that an oracle may try: launches of one rig band, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from pipeline.params import load
from rig.oracle.aim import hit
from rig.physics.launch import Trial, launch
from sling2sim2real.base.pool import Pool
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.settings.lab import SetupParams


@dataclass(frozen=True)
class ExactLaunches:
    """Launches without errors, as a landing map wants them.

    Attributes:
        landing_y: On the whole floor [m], NaN where there is none, shape (N,).
        hold_force: Of the drawn band on the hand [N], shape (N,).
        failure: None, or why there is no landing, length N.
    """

    landing_y: np.ndarray
    hold_force: np.ndarray
    failure: list[str | None]


class World:
    """A rig band to launch with, in processes of its own: a launch takes a second, on one core.

    A context, which ends them.
    """

    def __init__(
        self, band: str, path: str | Path = "params.yaml", workers: int | None = None
    ) -> None:
        """Launch `band` of the params.yaml at `path`."""
        self.band = band
        self._pool = Pool(_begin, band, Path(path).resolve(), workers=workers)

    def __enter__(self) -> World:
        return self

    def __exit__(self, *error: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def trials(self, draws: np.ndarray, numbers: Sequence[int | None]) -> list[Trial]:
        """Launches from draws (N, 2) [m] with the errors of trials by number; None: without.

        A draw of NaN is not launched: its target is out of reach.
        """
        return list(self._pool.map(_trial, draws, numbers))

    def landings(self, draws: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        """Where T draws (T, 2) land with the errors of trials (T, N) [m], NaN where one fails."""
        shape = np.shape(numbers)
        every = self.trials(np.repeat(draws, shape[1], axis=0), np.ravel(numbers).tolist())
        landing = [trial.landing_y if trial.failure is None else np.nan for trial in every]
        return np.reshape(landing, shape)

    def exact(self, draws: np.ndarray) -> ExactLaunches:
        """Launches without errors from draws (N, 2) [m]."""
        every = self.trials(draws, [None] * len(draws))
        return ExactLaunches(
            landing_y=np.array([trial.landing_y for trial in every]),
            hold_force=np.array([trial.hold_force for trial in every]),
            failure=[None if np.isfinite(trial.landing_y) else trial.failure for trial in every],
        )

    def landing_map(self, setup: SetupParams, size: tuple[int, int]) -> LandingMap:
        """Map launches without errors over the box of draws of `setup`."""
        box = {"draw_y": setup.draw_y, "draw_z": setup.draw_z, "max_force": setup.max_force}
        return LandingMap.simulate(self.exact, **box, size=size)

    def hits(self, targets: Sequence[float], starts: Sequence[np.ndarray]) -> np.ndarray:
        """Draws (T, 2) that land on T targets [m] without errors, each on the line of its start.

        NaN where a search does not come there.
        """
        return np.array(list(self._pool.map(_hit, targets, starts)))


_launch: Callable[[np.ndarray, int | None], Trial]  # in this process's world; `_begin` sets it


def _begin(band: str, path: Path) -> None:
    global _launch
    _launch = partial(launch, band, load(path))


def _trial(draw: np.ndarray, number: int | None) -> Trial:
    if np.isnan(draw).any():
        return Trial(np.nan, "out of reach", np.nan)
    return _launch(draw, number)


def _hit(target: float, start: np.ndarray) -> np.ndarray:
    return hit(lambda draw: _trial(draw, None).landing_y, target, start)
