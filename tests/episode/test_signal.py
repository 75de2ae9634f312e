"""Filter against its closed form, averages against integrals."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from sling2sim2real.episode.signal import (
    as_recorded,
    average,
    cutoff_hz,
    lowpass,
    recording_matrix,
)


def test_the_papers_cutoff_is_the_same_frequency_at_any_rate() -> None:
    assert cutoff_hz(0.224, "rad/sample") == pytest.approx(35.65, abs=0.01)
    assert cutoff_hz(0.224, "rad/s") == pytest.approx(0.03565, abs=1e-5)
    assert cutoff_hz(12.0, "Hz") == 12.0


def test_lowpass_has_the_gain_of_butterworth_squared_and_no_delay() -> None:
    cutoff = 35.65
    for rate, frequency in product((1000.0, 333.0), (5.0, 35.65, 80.0)):
        t = np.arange(0, 4, 1 / rate)
        # Second order, bilinear transform, forwards and backwards.
        ratio = math.tan(math.pi * frequency / rate) / math.tan(math.pi * cutoff / rate)
        wave = np.sin(math.tau * frequency * t)
        inside = slice(len(t) // 4, -len(t) // 4)
        expected = wave[inside] / (1 + ratio**4)
        np.testing.assert_allclose(lowpass(wave, rate, cutoff)[inside], expected, atol=2e-3)


def test_lowpass_treats_columns_alike_and_keeps_what_it_cannot_filter() -> None:
    """A constant; and everything, where the cutoff lies beyond Nyquist's frequency."""
    x = np.random.default_rng(0).normal(size=(500, 3))
    np.testing.assert_allclose(lowpass(x, 1000, 35)[:, 1], lowpass(x[:, 1], 1000, 35))
    np.testing.assert_allclose(lowpass(np.full(500, 3.0), 1000, 35), 3.0)
    np.testing.assert_array_equal(lowpass(x, 60, 35), x)


def test_average_is_the_integral_of_the_line_through_irregular_samples() -> None:
    random = np.random.default_rng(1)
    t = np.sort(np.append(random.uniform(0, 2, 300), [0, 2]))
    means = average(t, np.stack([3 * t - 1, 0 * t + 7], 1), 0.1, 0.05, 20)
    middles = 0.1 + 0.05 * (np.arange(20) + 0.5)
    np.testing.assert_allclose(means, np.stack([3 * middles - 1, np.full(20, 7)], 1), atol=1e-12)


@pytest.mark.parametrize("cutoff", [0.5, 5.0, 35.65, 600.0])
@pytest.mark.parametrize("ends", [(0.0, 4.0), (0.7, 3.1)])  # times before and after the simulation
def test_the_matrix_does_what_is_done_to_a_force(cutoff, ends) -> None:
    """Whose columns are looked for in windows, at irregular times."""
    rng = np.random.default_rng(1)
    t = np.sort(rng.uniform(*ends, 400))
    x = rng.normal(size=(400, 3))
    recorded = as_recorded(t, x, cutoff, 0.0, 0.03, 133)
    matrix = recording_matrix(t, cutoff, 0.0, 0.03, 133)
    np.testing.assert_allclose(matrix @ x, recorded, atol=1e-11)
