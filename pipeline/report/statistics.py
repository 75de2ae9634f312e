"""What launches say: landing errors, predictions, and which differences are no chance."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import numpy as np
import pandas as pd
from scipy import stats

LEVEL = 0.95
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


def differences(trials: pd.DataFrame, references: Iterable[str]) -> pd.DataFrame:
    """How much further off each method lands than each reference, `beside`: see `difference`."""
    rows, aimed = [], trials.loc[trials.target.notna()]
    for _, here in aimed.groupby(["name", "band", "source"], sort=False):
        launches = dict([*here.groupby("method", sort=False)])
        for method, other in product(launches, references):
            if method != other and other in launches:
                whose = launches[method][WHOSE].iloc[0].to_dict()
                against = difference(launches[other], launches[method])
                rows.append(whose | {"beside": other} | against)
    return pd.DataFrame(rows)


def difference(first: pd.DataFrame, second: pd.DataFrame) -> dict:
    """How much further off `second` lands than `first`: the mean over targets that both reach.

    Virtual launches of equal target and trial share their errors and are compared in pairs;
    measured ones are not. The interval is Student's t with the degrees of freedom of Welch and
    Satterthwaite, for targets may spread differently. It says what other launches of the same two
    policies would show, and nothing of another recording or seed: there is one of each.

    Returns:
        `mean`, `low` and `high` [m], NaN where nothing is compared, or where a target has but one
        launch; of each, the first last, `launches` that are compared, and the share of all that
        `failed`; `left_out`, how many of both failed, with the other half of a pair.
    """
    good = [trials.loc[trials.miss.notna()] for trials in (first, second)]
    if {*first.source, *second.source} == {"virtual"}:
        both = pd.merge(*good, on=["target", "trial"], suffixes=("_beside", ""))
        farther = both.miss.abs() - both.miss_beside.abs()
        change = [(part,) for _, part in farther.groupby(both.target)]
        counts = len(both), len(both)
    else:
        common = sorted({*good[0].target} & {*good[1].target})
        size = [[t.miss[t.target == target].abs() for target in common] for t in good]
        change = [(there, -here) for here, there in zip(*size, strict=True)]
        counts = tuple(sum(map(len, parts)) for parts in size)
    mean = np.mean([sum(part.mean() for part in parts) for parts in change]) if change else np.nan
    parts = [part for of_target in change for part in of_target]
    shares = np.array([part.var() / len(part) for part in parts])
    freedom = np.array([len(part) - 1 for part in parts])
    reach = np.sqrt(shares.sum()) / len(change) if change else np.nan
    if reach > 0:
        welch = shares.sum() ** 2 / (shares**2 / freedom).sum()
        reach *= stats.t.isf((1 - LEVEL) / 2, welch)
    return {
        "mean": mean,
        "low": mean - reach,
        "high": mean + reach,
        "launches": counts[1],
        "launches_beside": counts[0],
        "failed": second.miss.isna().mean(),
        "failed_beside": first.miss.isna().mean(),
        "left_out": len(first) + len(second) - sum(counts),
    }
