"""How much a residual is worth: variance, and how far along time and band it repeats itself.

Residuals at the optimum hold noise and the model's discrepancy alike. N of them that are correlated
are worth N / τ independent ones, τ the integrated autocorrelation time (Sokal 1997); along time and
along the band the two multiply. So J' J of a group counts 1 / (σ² τ). What is smooth is no noise at
all, and counts as one residual.
"""

from __future__ import annotations

import numpy as np

from pipeline.confidence.residuals import Group

NOISE = 0.3  # correlation of neighbours up to which residuals pass for noise
RECOIL_PRIOR = 4.0  # independent residuals that the held band's variance counts for in the recoil


def autocorrelation_time(series: np.ndarray) -> float:
    """Integrated autocorrelation time along the first axis, 1 for white noise.

    About zero, not about the mean: an offset that a model cannot follow is one error, not many.
    Summed as long as sums of neighbouring lags are positive (Geyer 1992).

    Args:
        series: Shape (T,) or (T, B), whose columns are averaged; NaN where there is nothing.
    """
    series = np.asarray(series, float).reshape(len(series), -1)
    there = np.isfinite(series)
    count, length = there.sum(), len(series)
    series = np.where(there, series, 0.0)
    padded = np.fft.rfft(series, 2 * length, axis=0)
    sums = np.fft.irfft(np.abs(padded) ** 2, axis=0)[:length].sum(axis=1)
    if not count or sums[0] <= 0:
        return 1.0
    correlation = np.append(sums / sums[0], 0.0)
    pairs = correlation[: len(correlation) // 2 * 2].reshape(-1, 2).sum(axis=1)
    positive = np.cumprod(pairs > 0).astype(bool)
    return float(np.clip(2 * pairs[positive].sum() - 1, 1.0, length))


def dense(group: Group, residual: np.ndarray) -> np.ndarray:
    """A group's residuals by time and place, NaN where there is none, shape (T, B)."""
    when, where = (group.grid - group.grid.min(axis=0)).T
    table = np.full((when.max() + 1, where.max() + 1), np.nan)
    table[when, where] = residual[group.rows]
    return table


def smoothness(table: np.ndarray) -> float:
    """Correlation of neighbours along the first axis, about zero; NaN where there is nothing."""
    first, second = table[:-1], table[1:]
    both = np.isfinite(first) & np.isfinite(second)
    first, second = first[both], second[both]
    size = np.sqrt((first**2).sum() * (second**2).sum())
    return float((first * second).sum() / size) if size > 0 else 0.0


def independent(group: Group, residual: np.ndarray) -> float:
    """How many independent residuals those of a group are worth, at least 1.

    Noise averages out, the model's discrepancy does not: it may lie along any change of the
    parameters. So far as neighbours agree by more than NOISE, in time or along the band, the
    residuals are discrepancy and worth one together.
    """
    table = dense(group, residual)
    tau = autocorrelation_time(table) * autocorrelation_time(table.T)
    agree = max(smoothness(table), smoothness(table.T))
    discrepancy = np.clip((agree - NOISE) / (1 - NOISE), 0.0, 1.0)
    share = (1 - discrepancy) * min(tau / len(group.rows), 1.0) + discrepancy
    return 1 / share


def weights(
    groups: list[Group],
    residual: np.ndarray,
    most: np.ndarray | None = None,
) -> tuple[np.ndarray, list[dict]]:
    """Weight 1 / (σ² τ) of each group, and what it rests on.

    The recoil shows itself in so few frames and samples that its own fitted residuals say little
    of its variance: that of the held band counts for RECOIL_PRIOR independent ones beside them.

    Args:
        residual: At the optimum, shape (R,).
        most: Mean squares by group that are known to be reached at once: none counts for more, or
            a group that is given up would weigh ever less.

    Returns:
        Weights, shape (G,), and a list of {channel, phase, rms, independent, count}.
    """
    table = []
    for number, group in enumerate(groups):
        square = float(np.mean(residual[group.rows] ** 2))
        if most is not None:
            square = min(square, float(most[number]))
        table.append(
            {
                "channel": group.channel,
                "phase": group.phase,
                "part": group.part,
                "rms": np.sqrt(square),
                "independent": independent(group, residual),
                "count": len(group.rows),
            }
        )
    # sorted by part: the band as it is held, fully drawn, comes last
    held = {one["channel"]: one["rms"] ** 2 for one in table if one["phase"] == "taut"}
    result = []
    for one in table:
        variance = one["rms"] ** 2
        if one["phase"] == "recoil" and one["channel"] in held:
            own = one["independent"]
            prior = RECOIL_PRIOR * held[one["channel"]]
            variance = (prior + own * variance) / (RECOIL_PRIOR + own)
        one["sigma"] = np.sqrt(variance)
        result.append(one["independent"] / one["count"] / max(variance, 1e-18))
    return np.array(result), table
