"""One measure for methods that minimise different losses: the paper's, as printed."""

from __future__ import annotations

import numpy as np
import pandas as pd

PRINTED = ("geom", "force", "work")  # the paper's loss is their sum (docs/method.md)


def printed(history: pd.DataFrame) -> np.ndarray:
    """The paper's printed loss of every row, shape (N,), whatever the method minimised."""
    total = history[list(PRINTED)].sum(axis=1, skipna=False).to_numpy(float)
    return np.where(np.isfinite(total), total, np.inf)


def best_so_far(history: pd.DataFrame) -> np.ndarray:
    """Row of the least total of the method's own loss among the rows so far, shape (N,)."""
    total = history.total.to_numpy(float)
    total = np.where(np.isfinite(total), total, np.inf)
    better = np.append(True, total[1:] < np.minimum.accumulate(total)[:-1])
    return np.maximum.accumulate(np.where(better, np.arange(len(total)), 0))


def has_another_loss(weights: dict[str, float]) -> bool:
    """Whether a method's weights are others than the printed loss's."""
    return any(weight != (name in PRINTED) for name, weight in weights.items())
