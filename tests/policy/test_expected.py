"""Expectations over a normal landing against SciPy's folded normal and numerical integration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, stats

from pipeline.policy.expected import closeness, distance

GAPS = np.array([-0.8, -0.03, 0.0, 0.001, 0.02, 0.5])


@pytest.mark.parametrize("spread", [1e-4, 0.02, 0.3])
def test_distance_is_the_folded_normals_mean(spread: float) -> None:
    truth = stats.foldnorm.mean(np.abs(GAPS) / spread, scale=spread)
    np.testing.assert_allclose(distance(GAPS, np.full(6, spread)), truth, rtol=1e-9)


@pytest.mark.parametrize("scale", [0.05, 1.0])
@pytest.mark.parametrize("spread", [0.02, 0.3])
def test_closeness_is_the_integral(spread: float, scale: float) -> None:
    for gap in GAPS:

        def inside(x: float, gap: float = gap) -> float:
            return np.exp(-abs(x) / scale) * stats.norm.pdf(x, gap, spread)

        ends = (gap - 10 * spread, gap + 10 * spread)
        truth, _ = integrate.quad(inside, *ends, points=[0.0], epsabs=1e-12, limit=200)
        assert closeness(gap, spread, scale) == pytest.approx(truth, rel=1e-8)


@given(st.floats(-20, 20), st.floats(0, 5), st.floats(1e-3, 10))
def test_bounds_hold_everywhere(gap: float, spread: float, scale: float) -> None:
    """Never NaN: between the bounds of Jensen and of the mean of |X|."""
    near, far = closeness(gap, spread, scale), distance(gap, spread)
    assert abs(gap) - 1e-9 <= far <= np.hypot(gap, spread) + 1e-9
    assert np.exp(-far / scale) * (1 - 1e-9) <= near <= 1


def test_without_spread_they_are_the_plain_ones() -> None:
    none = np.zeros(6)
    np.testing.assert_array_equal(distance(GAPS, none), np.abs(GAPS))
    np.testing.assert_array_equal(closeness(GAPS, none, 0.5), np.exp(-np.abs(GAPS) / 0.5))
    mixed = closeness(GAPS, np.where(GAPS > 0, 0.01, 0.0), 0.5)
    np.testing.assert_array_equal(mixed[:3], np.exp(-np.abs(GAPS[:3]) / 0.5))
