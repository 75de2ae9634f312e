"""Which differences between landing errors are more than noise: a bootstrap over launches.

Percentiles of resampled means, adjusted to few launches: n of a target give n - 1 draws, so that
the resampled mean has the unbiased variance, and the tails are those that Student's t has where a
normal variable has 2.5 % (the expanded percentiles of Hesterberg 2015). With five normal pairs at
each of three targets, 95 % of such intervals hold the truth where targets spread alike and 93 to
94 % where one spreads three to twenty times as much; with two or three pairs at a target they hold
it less often.

An interval says what other launches of the same two policies would show. It says nothing of what
another recording or another seed of the identification would: there is one of each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import ndtr, stdtrit

from sling2sim2real.base.target import TARGET_AREA

LEVEL = 0.95
RESAMPLES = 10_000


@dataclass(frozen=True)
class Difference:
    """Mean |y - g| of one policy less that of another [m], and where LEVEL of the resamples lie.

    Attributes:
        launches: Compared, of each policy: pairs where virtual launches share their errors.
        failed: Share of each policy's launches that failed.
        left_out: Launches of either that failed, and with a pair its other half.
        low, high: NaN where a target has but one launch.
    """

    mean: float
    low: float
    high: float
    launches: tuple[int, int]
    failed: tuple[float, float]
    left_out: int

    @property
    def real(self) -> bool:
        """Whether the interval leaves out zero."""
        return self.low > 0 or self.high < 0


def landed(trials: pd.DataFrame) -> pd.Series:
    """Whether each launch counts: it landed, and within the fixed target area."""
    inside = trials.landing_y.between(*TARGET_AREA)
    return trials.failure.isna() & trials.landing_y.notna() & inside


def difference(first: pd.DataFrame, second: pd.DataFrame, seed: int) -> Difference | None:
    """How much further off `second` lands than `first`: the mean over targets that both reach.

    Args:
        first, second: Trials of one kind. Virtual ones of equal target and trial share their
            errors and are compared in pairs; measured ones are not.

    Returns:
        None where nothing is left to compare.
    """
    first, second = (t.loc[t.target.notna()] for t in (first, second))
    tried = len(first) + len(second)
    failed = float((~landed(first)).mean()), float((~landed(second)).mean())
    first, second = (t.loc[landed(t)] for t in (first, second))
    if {*first.kind, *second.kind} == {"virtual"}:
        keys = ["target", "trial"]
        common = first[keys].merge(second[keys])
        first, second = (common.merge(t, on=keys, how="left") for t in (first, second))
        change = [(b - a,) for a, b in zip(_misses(first), _misses(second), strict=True)]
    else:
        common = set(first.target) & set(second.target)
        first, second = (t.loc[t.target.isin(common)] for t in (first, second))
        change = [(b, -a) for a, b in zip(_misses(first), _misses(second), strict=True)]
    if not change:
        return None
    rng = np.random.default_rng(seed)
    mean = np.mean([sum(part.mean() for part in parts) for parts in change])
    means = [[_resampled(part, rng) for part in parts] for parts in change]
    resampled = np.mean(np.sum(means, axis=1), axis=0)
    tail = ndtr(stdtrit(_freedom(change), (1 - LEVEL) / 2))
    low, high = np.quantile(resampled, [tail, 1 - tail])
    launches = len(first), len(second)
    left_out = tried - sum(launches)
    return Difference(float(mean), float(low), float(high), launches, failed, left_out)


def _freedom(change: list[tuple]) -> float:
    """Degrees of freedom of Student's t (Welch, Satterthwaite): targets may spread differently."""
    some = [part for parts in change for part in parts if len(part) > 1]
    shares = np.array([part.var(ddof=1) / len(part) for part in some])
    degrees = sum(share**2 / (len(part) - 1) for share, part in zip(shares, some, strict=True))
    return shares.sum() ** 2 / degrees if degrees else 1.0


def _misses(trials: pd.DataFrame) -> list[np.ndarray]:
    """|y - g| [m] of each target's launches, in the order of the targets."""
    return [
        (of_target.landing_y - target).abs().to_numpy()
        for target, of_target in trials.groupby("target")
    ]


def _resampled(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Means of n - 1 draws of n values with replacement, shape (RESAMPLES,); NaN of one value."""
    count = len(values)
    if count < 2:
        return np.full(RESAMPLES, np.nan)
    return rng.choice(values, (RESAMPLES, count - 1)).mean(1)
