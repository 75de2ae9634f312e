"""Rank statistics of simulation-based calibration: are posteriors as wide as they say?

Where the truth is drawn from the prior, its rank among samples of the posterior is even (Talts et
al., Validating Bayesian inference algorithms with simulation-based calibration, arXiv 1804.06788):
intervals that are too narrow pile it up at both ends, too wide ones in the middle, a bias at one.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import binomtest, kstest

BINS, LEVEL = 10, 0.9


def part_below(samples: np.ndarray, truth: np.ndarray, place: float = 0.5) -> np.ndarray:
    """Share of samples (M, ...) below the truth (...).

    Args:
        place: Of the truth among the samples that equal it, from 0 to 1; drawn evenly, the rank of
            a parameter that is often exactly 0 is even too.
    """
    equal = np.sum(samples == truth, axis=0) + 1
    return (np.sum(samples < truth, axis=0) + place * equal) / (len(samples) + 1)


def summary(parts: np.ndarray) -> dict:
    """What shares below (N,) of N episodes say.

    Returns:
        "histogram" in BINS; "coverage" of the central LEVEL, "coverage_interval" in which N
        episodes leave it (95 %, Wilson); "mean", 0.5 without a bias; "spread" over that of an even
        rank, less than 1 where intervals are too wide; "p" that an even rank is as uneven
        (Kolmogorov and Smirnov).
    """
    inside = np.abs(parts - 0.5) <= LEVEL / 2
    interval = binomtest(int(inside.sum()), len(inside)).proportion_ci(method="wilson")
    return {
        "histogram": np.histogram(parts, BINS, (0, 1))[0],
        "coverage": inside.mean(),
        "coverage_interval": [interval.low, interval.high],
        "mean": parts.mean(),
        "spread": np.sqrt(12 * np.mean((parts - 0.5) ** 2)),
        "p": kstest(parts, "uniform").pvalue,
    }
