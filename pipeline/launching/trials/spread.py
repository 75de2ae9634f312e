"""Where launches may land: neither θ nor its law is exactly the rubber's, and no draw is exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from pipeline.launching.surface.landing_map import Launched, Launcher
from pipeline.simulator.launch import landing_gradient
from pipeline.simulator.parameters import Parameters

LEVEL = 0.9
MOST = 60  # samples of θ that are launched
ERRORS = ndtri((np.arange(401) + 0.5) / 401)  # equally likely; 41 end 6 % too soon


@dataclass(frozen=True)
class Spread:
    """Landings of N draws.

    Attributes:
        centres: With each sample of θ, or with θ alone [m], shape (N, M); NaN where one fails.
        slope: Standard deviation by the error of the draw [m], shape (N,).
        interval: Central 90 % [m], shape (N, 2); NaN where launches fail.
    """

    centres: np.ndarray
    slope: np.ndarray
    interval: np.ndarray


def landing_intervals(
    launcher: Launcher, draws: np.ndarray, samples: Parameters | None, error: float
) -> np.ndarray:
    """The intervals of `landing_spread`, shape (N, 2)."""
    return landing_spread(launcher, draws, samples, error).interval


def landing_spread(
    launcher: Launcher, draws: np.ndarray, samples: Parameters | None, error: float
) -> Spread:
    """Where draws may land.

    Landings of samples of θ, what the law gets wrong among them (`returned_share`), spread by the
    error of the draw through the launch's own gradient. More than a tenth of failures among the
    samples is a failure.

    Args:
        launcher: `launcher(draws)` launches with the best θ; `launcher(draws, parameters)` with
            others.
        draws: (y, z) [m], shape (N, 2).
        samples: M, of θ; None leaves out that θ is not known exactly.
        error: Standard deviation of the drawn position along each axis [m].
    """
    draws = np.atleast_2d(np.asarray(draws, float))
    count = len(draws)
    landing, gradient = landing_gradient(lambda around: _landing(launcher(around)), draws)
    spread = error * np.linalg.norm(gradient, axis=1)
    centres = landing[:, None]
    if samples is not None:
        some = samples[np.linspace(0, len(samples) - 1, min(MOST, len(samples))).astype(int)]
        launched = launcher(
            np.repeat(draws, len(some), axis=0), some[np.tile(np.arange(len(some)), count)]
        )
        centres = _landing(launched).reshape(count, len(some))
    result = np.full((count, 2), np.nan)
    for row, (centre, width) in enumerate(zip(centres, spread, strict=True)):
        good = centre[np.isfinite(centre)]
        if len(good) >= 0.9 * len(centre) and np.isfinite(width):
            all_of_them = (good[:, None] + width * ERRORS).ravel()
            result[row] = np.quantile(all_of_them, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return Spread(centres, spread, result)


def _landing(launched: Launched) -> np.ndarray:
    good = np.array([failure is None for failure in launched.failure])
    return np.where(good, np.asarray(launched.landing_y, float), np.nan)
