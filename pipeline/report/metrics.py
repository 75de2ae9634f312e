"""reports/summary.json: the run in a dozen numbers, for `dvc metrics` and `dvc exp show`.

Names are short, so that a terminal of 120 columns has room for three bands. A key stands where
there is such a number.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from pipeline.report.results import Result, Results
from pipeline.report.tables.landings import (
    LAUNCHED,
    intervals,
    landing_errors,
    of_kind,
    prediction_error,
)
from sling2sim2real.quantities import QUANTITIES

YOUNG = QUANTITIES["youngs_modulus"]
DIGITS = 3  # another kind of CPU differs beyond them


def summary(results: Results, main: str, theirs: str | None) -> dict[str, float]:
    """How well the run came out.

    Returns:
        `<band>_cm`, the mean landing error of the main method, or where none is known `<band>_kPa`,
        its Young's modulus; over bands: `floors`, the error in actuation floors, and `paper_cm`,
        the error of the paper's method; over launches of the main method: `failed`, `bias_%` of
        its predictions, `in_90_%` of its intervals, and their median `width_%` of the distance.
    """
    metrics: dict[str, float | None] = {}
    ratios, beside = [], []
    for band, methods in results.methods.items():
        error = _error(methods[main])
        if error is None:
            modulus = methods[main].theta["theta"]["youngs_modulus"]
            metrics[f"{band}_{YOUNG.unit}"] = YOUNG.factor * modulus
            continue
        metrics[f"{band}_cm"] = 100 * error
        if band in results.least:
            ratios.append(error / results.least[band])
        if theirs is not None:
            beside.append(_error(methods[theirs]))
    some = [methods[main].trials for methods in results.methods.values()]
    trials = pd.concat(some, ignore_index=True)
    trials = of_kind(trials, *LAUNCHED)
    metrics["floors"] = _mean(ratios)
    metrics["paper_cm"] = _mean([100 * error_m for error_m in beside if error_m is not None])
    if len(trials):
        aimed = landing_errors(trials)["all"]
        metrics["failed"] = aimed.failed if aimed.launches else None
        metrics["bias_%"] = 100 * prediction_error(trials)["all"].bias
        coverage = (intervals(trials) or {}).get("all")
        if coverage and coverage.launches:
            metrics["in_90_%"] = 100 * coverage.covered / coverage.launches
            metrics["width_%"] = 100 * coverage.width
    return {
        name: value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")
        for name, value in metrics.items()
        if value is not None and np.isfinite(value)
    }


def _error(result: Result) -> float | None:
    """Mean error of the launches that had a target [m]; None without one that counts."""
    mean = landing_errors(of_kind(result.trials, *LAUNCHED))["all"].mean
    return mean if np.isfinite(mean) else None


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None
