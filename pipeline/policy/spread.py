"""Where launches may land: neither θ nor its law is exactly the rubber's, and no draw is exact."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from pipeline.errors import UserError
from pipeline.sling.model import THETA
from pipeline.stage import remedy

LEVEL = 0.9
MOST = 60  # samples of θ that are launched
STEP = 1e-3  # m, small against the box of draws and large against the simulator's rounding
CROSS = STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
ERRORS = ndtri((np.arange(401) + 0.5) / 401)  # equally likely; 41 end 6 % too soon


def load_samples(run, path: Path, band: str, method: str) -> np.ndarray | None:
    """Samples of θ, and of the air's drag if searched, (M, 5) or (M, 6); None where there are none.

    `run` is params.yaml's, which says what stage makes them. Raises UserError where the file is
    damaged.
    """
    if not path.is_file():
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if content["samples"] == []:
            return None
        samples = np.array(content["samples"], float)
        known = content["names"] in (list(THETA), [*THETA, "air_drag"])
        if not known or samples.ndim != 2 or samples.shape[1] != len(content["names"]):
            raise ValueError
    except (OSError, ValueError, KeyError, TypeError) as error:
        makes = remedy(run, "theta", band, method, damaged=True)
        raise UserError(f"{path}: damaged; {makes}") from error
    return samples


def law_discrepancy(content: dict) -> float:
    """Share of a landing by which the law errs, as a θ file says it; 0 where it says nothing."""
    known = content.get("confidence") or {}
    return float(known.get("discrepancy", {}).get("landing", 0.0))


def landing_intervals(
    launcher: Callable,
    draws: np.ndarray,
    samples: np.ndarray | None,
    error: float,
    discrepancy: float = 0.0,
) -> np.ndarray:
    """Central 90 % of the landings of each draw [m], shape (N, 2); NaN where launches fail.

    Landings of samples of θ, spread by the error of the draw through the launch's own gradient, and
    by what the recording shows of the law's error (pipeline/confidence/discrepancy.py). Both are
    normal and independent, so they add in quadrature. More than a tenth of failures among the
    samples is a failure.

    Args:
        launcher: `launcher(draws)` launches with the best θ; `launcher(draws, thetas)` with others.
        draws: (y, z) [m], shape (N, 2).
        samples: Of θ, shape (M, P); None leaves out that θ is not known exactly.
        error: Standard deviation of the drawn position along each axis [m].
        discrepancy: Of the landing, as a share of it.
    """
    draws = np.atleast_2d(np.asarray(draws, float))
    count = len(draws)
    around = launcher((draws[:, None] + CROSS).reshape(-1, 2))
    landing = _landing(around).reshape(count, len(CROSS))
    gradient = (landing[:, 1::2] - landing[:, 2::2]) / (2 * STEP)  # (N, 2)
    spread = np.hypot(error * np.linalg.norm(gradient, axis=1), discrepancy * landing[:, 0])
    centres = landing[:, :1]
    if samples is not None:
        some = samples[np.linspace(0, len(samples) - 1, min(MOST, len(samples))).astype(int)]
        launched = launcher(np.repeat(draws, len(some), axis=0), np.tile(some, (count, 1)))
        centres = _landing(launched).reshape(count, len(some))
    result = np.full((count, 2), np.nan)
    for row, (centre, width) in enumerate(zip(centres, spread, strict=True)):
        good = centre[np.isfinite(centre)]
        if len(good) >= 0.9 * len(centre) and np.isfinite(width):
            all_of_them = (good[:, None] + width * ERRORS).ravel()
            result[row] = np.quantile(all_of_them, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return result


def _landing(launched) -> np.ndarray:
    good = np.array([failure is None for failure in launched.failure])
    return np.where(good, np.asarray(launched.landing_y, float), np.nan)
