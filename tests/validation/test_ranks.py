"""Ranks of the truth are even where a posterior is right, and tell how it is wrong."""

import numpy as np
import pytest

from validation.ranks import part_below, summary

EPISODES, SAMPLES, NOISE = 400, 100, 0.5


def ranks(width: float = 1.0, shift: float = 0.0) -> dict:
    """Of a Gaussian truth with prior N(0, 1) that is measured once, its posterior changed.

    Args:
        width: Times the posterior's own.
        shift: In its standard deviations.
    """
    rng = np.random.default_rng(5)
    truth = rng.normal(0, 1, EPISODES)
    seen = truth + rng.normal(0, NOISE, EPISODES)
    precision = 1 + NOISE**-2
    spread = precision**-0.5
    mean = seen * NOISE**-2 / precision + shift * spread
    samples = mean + width * spread * rng.normal(0, 1, (SAMPLES, EPISODES))
    return summary(part_below(samples, truth))


def test_a_right_posterior_has_even_ranks() -> None:
    right = ranks()
    assert right["p"] > 0.05 and right["coverage"] == pytest.approx(0.9, abs=0.03)
    assert right["histogram"].sum() == EPISODES and right["histogram"].min() > EPISODES / 20
    low, high = right["coverage_interval"]
    assert low < right["coverage"] < high and high - low == pytest.approx(0.06, abs=0.01)
    assert right["mean"] == pytest.approx(0.5, abs=0.03)
    assert right["spread"] == pytest.approx(1, abs=0.05)


def test_a_wrong_one_is_told_by_their_form() -> None:
    narrow, wide, off = ranks(width=0.5), ranks(width=2.0), ranks(shift=0.5)
    assert max(figures["p"] for figures in (narrow, wide, off)) < 1e-3
    assert narrow["coverage"] < 0.7 and narrow["spread"] > 1.2
    assert wide["coverage"] > 0.97 and wide["spread"] < 0.8
    assert off["mean"] < 0.4
