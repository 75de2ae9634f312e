"""What launches say: landing errors and predictions."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pandas as pd

WHOSE = ["name", "band", "method", "source"]  # columns that say whose launches a row is of
ALL = "all"  # targets


def landing_errors(trials: pd.DataFrame) -> pd.DataFrame:
    """How far from their targets launches landed: a row of WHOSE and target, one of ALL targets.

    Columns launches, `failed` (or outside the target area), and of the others [m], NaN where not
    known: mean and std of |landing - target|, bias (mean of landing - target), and `within`, the
    deviation within targets, each weighed by its launches less one: the paper's "±" mixes the two.
    """
    rows = []
    aimed = trials.loc[trials.target.notna()]
    for whose, launches in aimed.groupby(WHOSE, sort=False):
        of_targets = [_errors(at) | {"target": g} for g, at in launches.groupby("target")]
        total = _errors(launches) | {"target": ALL, "within": within(of_targets)}
        rows += [dict(zip(WHOSE, whose, strict=True)) | row for row in (*of_targets, total)]
    columns = (*WHOSE, "target", "launches", "failed", "mean", "std", "within", "bias")
    return pd.DataFrame(rows, columns=columns)


def _errors(launches: pd.DataFrame) -> dict:
    size = launches.miss.abs()
    std = size.std()
    return {
        "launches": len(launches),
        "failed": int(launches.miss.isna().sum()),
        "mean": size.mean(),
        "std": std,
        "within": std,
        "bias": launches.miss.mean(),
    }


def within(rows: Iterable[dict]) -> float:
    """Deviation within targets [m]; NaN of none."""
    known = [row for row in rows if np.isfinite(row["std"])]
    freedom = [row["launches"] - row["failed"] - 1 for row in known]
    squares = [n * row["std"] ** 2 for n, row in zip(freedom, known, strict=True)]
    return float(np.sqrt(sum(squares) / sum(freedom))) if sum(freedom) else np.nan


def prediction_errors(launches: pd.DataFrame) -> dict:
    """How predictions of launches came out: `off` = predicted / landing - 1, and their intervals.

    Returns:
        `tried`, of which `unpredicted`; `compared`, of which `mean` and `most` are of the size of
        `off`, and `bias` is its mean; `ranged`, with an interval, of which `covered` hold the
        landing, and `width` is the median width of the interval as a share of the landing.
    """
    ranged = launches.loc[launches.predicted_low.notna() & launches.landing_y.notna()]
    landing, low, high = ranged.landing_y, ranged.predicted_low, ranged.predicted_high
    return {
        "tried": len(launches),
        "unpredicted": int(launches.predicted_y.isna().sum()),
        "compared": int(launches.off.notna().sum()),
        "mean": launches.off.abs().mean(),
        "most": launches.off.abs().max(),
        "bias": launches.off.mean(),
        "ranged": len(ranged),
        "covered": int(landing.between(low, high).sum()),
        "width": ((high - low) / landing).median(),
    }
