"""How much a residual is worth: variance, and how far along time and band it repeats itself.

Residuals at the optimum hold noise and the model's discrepancy alike: a random effect beside white
noise. N residuals whose noise is correlated are worth N / τ independent ones, τ the integrated
autocorrelation time (Sokal 1997); along time and along the band the two multiply. Discrepancy does
not average out, neither within a group nor over those of one phase.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from pipeline.confidence.residuals import Group

NOISE = 0.3  # correlation of neighbours, or excess of variance, that may still be noise
CHANCE = 2.0  # deviations of a correlation, 1 / sqrt(count) each, that may be chance
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


def discrepant(group: Group, residual: np.ndarray, variance: float, noise: float) -> float:
    """Share of a group's variance that is the model's discrepancy, between 0 and 1.

    So far as neighbours agree, in time or along the band, and so far as residuals are larger than
    the noise, each by more than NOISE and what chance gives so few residuals (Bartlett 1946).

    Args:
        variance: Of the residuals.
        noise: That of the channel's noise alone.
    """
    table = dense(group, residual)
    excess = 1 - noise / variance if variance > 0 else 0.0
    agree = max(smoothness(table), smoothness(table.T), excess)
    allowed = NOISE + CHANCE / np.sqrt(len(group.rows))
    return float(np.clip((agree - allowed) / max(1 - allowed, 1e-9), 0.0, 1.0))


def noise_variance(group: Group, residual: np.ndarray) -> float:
    """Variance that differences of successive residuals show, half their mean square; maybe NaN."""
    change = np.diff(dense(group, residual), axis=0)
    change = change[np.isfinite(change)]
    return float(np.mean(change**2) / 2) if len(change) else float("nan")


def weights(
    groups: list[Group],
    residual: np.ndarray,
    most: np.ndarray | None = None,
) -> tuple[np.ndarray, list[dict]]:
    """Weight of each group's squared residuals, and what it rests on.

    A mean of N residuals is off by their noise, of which τ are worth one, and by the model's
    discrepancy, which does not average out: not within a group, for it may lie along any change of
    the parameters, nor over the G groups of a phase, for what makes one late makes all late. With
    the share d of the variance σ² that is discrepancy, J' J of a group of count residuals counts

        1 / (count σ² ((1 - d) τ / count + d G))

    so that a phase which a model does not follow is worth one residual, and one that it does is
    worth all of them. The noise is that of the held band, fully drawn, where nothing moves.

    The recoil shows itself in so few frames and samples that its own fitted residuals say little
    of its variance: that of the held band counts for RECOIL_PRIOR independent ones beside them.
    Elsewhere the noise of the held band counts for one beside them: a few residuals that parameters
    can fit exactly would else weigh ever more, from round to round, until nothing else counted.

    Args:
        residual: At the optimum, shape (R,).
        most: Mean squares by group that are known to be reached at once: none counts for more, or
            a group that is given up would weigh ever less.

    Returns:
        Weights, shape (G,), and a list of {channel, phase, part, rms, sigma, noise, independent,
        count}; `independent` residuals are what those of the group are worth, maybe less than one.
    """
    squares = [float(np.mean(residual[group.rows] ** 2)) for group in groups]
    if most is not None:
        squares = np.minimum(squares, most).tolist()
    # sorted by part: the band as it is held, fully drawn, comes last
    held = {
        group.channel: (square, noise_variance(group, residual))
        for group, square in zip(groups, squares, strict=True)
        if group.phase == "taut"
    }
    sharing = Counter(group.phase for group in groups)
    result, table = [], []
    for group, square in zip(groups, squares, strict=True):
        count, variance = len(group.rows), square
        drawn, noise = held.get(group.channel, (square, np.nan))
        if np.isfinite(noise):
            variance = (count * square + min(noise, drawn)) / (count + 1)
        else:  # unknown: none is seen above it
            noise = np.inf
        tau = correlated(group, residual)
        if group.phase == "recoil":
            own = 1 / worth(tau, discrepant(group, residual, variance, noise), count, 1)
            variance = (RECOIL_PRIOR * drawn + own * variance) / (RECOIL_PRIOR + own)
        share = discrepant(group, residual, variance, noise)
        one = worth(tau, share, count, sharing[group.phase])
        result.append(1 / (count * max(variance, 1e-18) * one))
        table.append(
            {
                "channel": group.channel,
                "phase": group.phase,
                "part": group.part,
                "rms": np.sqrt(square),
                "sigma": np.sqrt(variance),
                "noise": np.sqrt(min(noise, variance)),
                "independent": 1 / one,
                "count": count,
            }
        )
    return np.array(result), table


def correlated(group: Group, residual: np.ndarray) -> float:
    """How many residuals of a group are worth one, by their correlation in time and place."""
    table = dense(group, residual)
    return min(autocorrelation_time(table) * autocorrelation_time(table.T), len(group.rows))


def worth(tau: float, discrepant: float, count: int, sharing: int) -> float:
    """Variance of a group's mean over that of one residual."""
    return (1 - discrepant) * tau / count + discrepant * sharing
