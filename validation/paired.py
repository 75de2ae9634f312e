"""Means with intervals, and paired comparisons."""

from __future__ import annotations

import numpy as np

DRAWS = 10_000  # of the bootstrap
LEVEL = 0.95


def mean_interval(values: np.ndarray, seed: int = 1) -> dict:
    """Mean of finite values (N,), and its percentile bootstrap interval; None where there is none.

    Few values (N about 10) make such an interval somewhat too narrow.
    """
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    if not len(values):
        return {"n": 0, "mean": None, "low": None, "high": None, "std": None}
    rows = np.random.default_rng(seed).integers(len(values), size=(DRAWS, len(values)))
    low, high = np.quantile(values[rows].mean(axis=1), [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    std = float(values.std(ddof=1)) if len(values) > 1 else None
    return {
        "n": len(values),
        "mean": float(values.mean()),
        "low": float(low),
        "high": float(high),
        "std": std,
    }


def compared(values: dict[str, np.ndarray], reference: str) -> dict[str, dict]:
    """Mean difference of each method's values (N,) from the reference's, over finite pairs.

    Recordings of one band are no sample of bands: no test is made of them.
    """
    base = np.asarray(values[reference], float)
    return {
        name: mean_interval(np.asarray(method_values, float) - base)
        for name, method_values in values.items()
        if name != reference
    }
