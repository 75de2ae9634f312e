"""Samples within bounds against SciPy's truncated normal and against quadrature."""

import numpy as np
import pytest
from scipy import stats

from sling2sim2real.identification.posterior.sampling import truncated_gaussian


def sampled(centre, precision, low, high, count=4000, seed=0) -> np.ndarray:
    given = (np.array(argument, float) for argument in (centre, precision, low, high))
    return truncated_gaussian(*given, count, np.random.default_rng(seed))


@pytest.mark.parametrize(
    ("centre", "spread", "low", "high"),
    [(0, 1, -1, 2), (0, 2, 0.5, 9), (3, 0.5, -1, 1.5), (-4, 1, 0, 5), (1, 1, -50, 50)],
)
def test_one_dimension_is_scipys_truncated_normal(centre, spread, low, high):
    seen = sampled([centre], [[spread**-2]], [low], [high])[:, 0]
    truth = stats.truncnorm((low - centre) / spread, (high - centre) / spread, centre, spread)
    assert seen.min() >= low and seen.max() <= high
    assert stats.kstest(seen, truth.cdf).pvalue > 0.01


@pytest.mark.parametrize("side", [-1, 1])
def test_a_centre_far_outside_leaves_the_bound(side):
    """30 standard deviations away a tail has 1/30 of one: less than what is lost here."""
    seen = sampled([30.5 * side], [[1.0]], [-0.5], [0.5])
    np.testing.assert_allclose(seen, 0.5 * side, atol=1 / 30)


@pytest.mark.parametrize("low", [(-9, -9), (0.0, -9), (0.2, 0.4)])
def test_two_dimensions_have_the_moments_of_quadrature(low):
    centre, high = np.array([-0.3, 0.2]), np.array([2.0, 1.5])
    covariance = np.array([[1.0, 0.8], [0.8, 1.0]]) * 0.5
    precision = np.linalg.inv(covariance)
    seen = sampled(centre, precision, low, high, count=20_000)
    axes = [np.linspace(a, b, 801) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    gap = grid - centre
    weight = np.exp(-0.5 * np.einsum("ni,ij,nj->n", gap, precision, gap))
    weight /= weight.sum()
    mean = weight @ grid
    spread = np.einsum("n,ni,nj->ij", weight, grid - mean, grid - mean)
    np.testing.assert_allclose(seen.mean(axis=0), mean, atol=0.02)
    np.testing.assert_allclose(np.cov(seen.T), spread, atol=0.02)


def test_a_seed_gives_the_same_samples_and_another_does_not():
    gaussian = ([0, 0], [[2, 1], [1, 2]], [-1, -1], [1, 1])
    np.testing.assert_array_equal(sampled(*gaussian, 50), sampled(*gaussian, 50))
    assert not np.array_equal(sampled(*gaussian, 50), sampled(*gaussian, 50, seed=1))
