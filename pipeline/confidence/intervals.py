"""Samples as words: intervals, whether data tell a parameter at all, correlations."""

from __future__ import annotations

import numpy as np

from pipeline.confidence.axes import Axes

LEVEL = 0.9
FILLS = 2 / 3  # of the box's own interval: from here on a parameter is not identifiable


def interval(samples: np.ndarray) -> tuple[float, float]:
    """The central LEVEL of samples (M,)."""
    low, high = np.quantile(samples, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(low), float(high)


def identifiable(name: str, low: float, high: float, axes: Axes) -> bool:
    """Whether an interval is clearly narrower than that of the box, on the search's axis."""
    column = axes.space.names.index(name)
    box, found = (np.stack([axes.low, axes.high]) for _ in range(2))
    found[:, column] = low, high
    whole, told = (np.ptp(axes.space.to_unit(ends)[:, column]) for ends in (box, found))
    return bool(told < FILLS * LEVEL * whole)


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
