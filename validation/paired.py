"""Means with intervals, and paired comparisons corrected for how many there are."""

from __future__ import annotations

import numpy as np
from scipy.stats import wilcoxon

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


def holm(p: np.ndarray) -> np.ndarray:
    """p values (M,) adjusted by Holm's step-down method (Scand. J. Stat. 6, 1979, 65)."""
    p = np.asarray(p, float)
    order = np.argsort(p, kind="stable")
    steps = (len(p) - np.arange(len(p))) * p[order]
    adjusted = np.empty_like(p)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1)
    return adjusted


def compared(values: dict[str, np.ndarray], reference: str) -> dict[str, dict]:
    """Compare each method's values (N,) with the reference's, pair by pair.

    Returns:
        By method: the mean difference (method less reference) with its interval, over pairs of
        finite values; "p" of the two-sided Wilcoxon signed-rank test, and "p_holm" over all
        methods here. A method without a pair, or that never differs, has p = 1.
    """
    base = np.asarray(values[reference], float)
    differences = {}
    for name, method_values in values.items():
        if name == reference:
            continue
        difference = np.asarray(method_values, float) - base
        difference = difference[np.isfinite(difference)]
        p = float(wilcoxon(difference).pvalue) if np.any(difference) else 1.0
        differences[name] = mean_interval(difference) | {"p": p}
    adjusted = holm(np.array([row["p"] for row in differences.values()]))
    for row, value in zip(differences.values(), adjusted, strict=True):
        row["p_holm"] = float(value)
    return differences
