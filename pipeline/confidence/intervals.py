"""Samples as words: intervals, whether data tell a parameter at all, correlations."""

from __future__ import annotations

import numpy as np

from pipeline.confidence.axes import Axes

LEVEL = 0.9
FILLS = 2 / 3  # of the prior's own interval: from here on a parameter is not identifiable


def interval(samples: np.ndarray) -> tuple[float, float]:
    """The central LEVEL of samples (M,)."""
    low, high = np.quantile(samples, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)


def identifiable(name: str, low: float, high: float, axes: Axes, prior=None) -> bool:
    """Whether an interval is clearly narrower than that of the prior, on the search's axis.

    Args:
        prior: Mean and standard deviation, where more is known than the box.
    """
    column = axes.space.names.index(name)
    edges = np.tile(axes.low, (2, 1))
    edges[1] = axes.high
    box = axes.space.to_unit(edges)[:, column]
    known = box + (1 - LEVEL) / 2 * np.ptp(box) * np.array([1, -1])
    if prior is not None:
        mean, deviation = prior
        values = np.random.default_rng(0).normal(mean, deviation, 20000)
        values = values[(values > axes.low[column]) & (values < axes.high[column])]
        edges[:, column] = interval(values) if len(values) else (mean, mean)
        known = axes.space.to_unit(edges)[:, column]
    edges[:, column] = low, high
    return bool(np.ptp(axes.space.to_unit(edges)[:, column]) < FILLS * np.ptp(known))


def correlation(columns: dict[str, np.ndarray]) -> dict:
    """Correlation matrix of samples by name; 0 where one does not vary."""
    values = np.stack(list(columns.values()))
    spread = values.std(axis=1)
    centred = (values - values.mean(axis=1, keepdims=True)) / np.where(spread > 0, spread, np.inf)[
        :, None
    ]
    matrix = centred @ centred.T / values.shape[1]
    np.fill_diagonal(matrix, 1.0)
    return {"names": list(columns), "matrix": matrix.tolist()}
