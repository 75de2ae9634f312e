"""Where launches may land: neither θ nor its law is exactly the rubber's, and no draw is exact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from sling2sim2real.launching.surface.landing_map import Launcher
from sling2sim2real.simulator.launch import Launches, landing_gradient
from sling2sim2real.simulator.parameters import Parameters

LEVEL = 0.9
MOST = 60  # samples of θ that are launched
ERRORS = ndtri((np.arange(401) + 0.5) / 401)  # equally likely; 41 end 6 % too soon


@dataclass(frozen=True)
class Spread:
    """Landings of N draws.

    Attributes:
        chosen: Numbers of the samples of θ that are launched, shape (M,); None: θ alone is.
        centres: With each of them [m], shape (N, M); NaN where one fails.
        slope: Standard deviation by the error of the draw [m], shape (N,).
        interval: The shortest that holds 90 % [m], shape (N, 2); NaN where launches fail.
    """

    chosen: np.ndarray | None
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
    chosen, centres = None, landing[:, None]
    if samples is not None:
        chosen = np.linspace(0, len(samples) - 1, min(MOST, len(samples))).astype(int)
        some = samples[chosen]
        launched = launcher(
            np.repeat(draws, len(some), axis=0), some[np.tile(np.arange(len(some)), count)]
        )
        centres = _landing(launched).reshape(count, len(some))
    result = np.full((count, 2), np.nan)
    for row, (centre, width) in enumerate(zip(centres, spread, strict=True)):
        good = centre[np.isfinite(centre)]
        if len(good) >= 0.9 * len(centre) and np.isfinite(width):
            centre, kernel = smoothed(good)
            result[row] = shortest((centre[:, None] + np.hypot(width, kernel) * ERRORS).ravel())
    return Spread(chosen, centres, spread, result)


def smoothed(values: np.ndarray) -> tuple[np.ndarray, float]:
    """Values (N,) drawn together, and the Gaussian kernel that keeps mean and variance with them.

    The smoothed bootstrap of Silverman and Young (1987, 10.1093/biomet/74.3.469), by the normal
    reference rule: the shortest interval of a few bare values is too short.
    """
    share = min(1.06 * len(values) ** -0.2, 1.0)
    return values.mean() + (values - values.mean()) * np.sqrt(1 - share**2), share * values.std()


def shortest(values: np.ndarray) -> np.ndarray:
    """The shortest interval that holds a share LEVEL of equally likely values (N,), shape (2,).

    It is the region of highest density (Hyndman 1996, 10.1080/00031305.1996.10474359). A central
    interval would leave out the likeliest landings where a parameter lies at the end of its range,
    as that of a rubber which does not soften.
    """
    values = np.sort(values)
    inside = int(np.ceil(LEVEL * len(values))) - 1
    first = int(np.argmin(values[inside:] - values[: len(values) - inside]))
    return values[[first, first + inside]]


def _landing(launched: Launches) -> np.ndarray:
    good = np.array([failure is None for failure in launched.failure])
    return np.where(good, np.asarray(launched.landing_y, float), np.nan)
