"""Regions of a search: non-maximum suppression, covariances of neighbours."""

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.searches import regions as module
from sling2sim2real.identification.searches.regions import (
    find_regions,
    isotropic,
    regularised,
    suppress,
)

COARSE = st.sampled_from([0.0, 0.05, 0.3, 0.5, 1.0])  # so that points coincide


def test_suppression_equals_its_definition() -> None:
    """Kept: the best row, and then every row further than delta from all kept better ones."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        unit, total = rng.random((60, 3)), rng.random(60)
        left, expected = set(range(60)), []
        while left:
            best = min(left, key=lambda row: total[row])
            expected.append(best)
            left = {row for row in left if np.linalg.norm(unit[row] - unit[best]) > 0.4}
        assert suppress(unit, total, 0.4, 100) == expected
        assert suppress(unit, total, 0.4, 2) == expected[:2]
        assert all(np.linalg.norm(unit[i] - unit[j]) > 0.4 for i, j in combinations(expected, 2))


def test_covariance_is_that_of_the_nearest_successes() -> None:
    """Two clouds of known covariance; failed rows at the centres have no say."""
    rng = np.random.default_rng(1)
    factors = np.diag([0.02, 0.01, 0.005]), np.diag([0.02, 0.01, 0.01])
    factors[1][1, 0] = 0.015
    centres = np.array([[0.25, 0.25, 0.5], [0.75, 0.75, 0.5]])
    count = 4000
    clouds = [c + rng.normal(size=(count, 3)) @ f.T for c, f in zip(centres, factors, strict=True)]
    unit = np.concatenate([centres, *clouds, centres])
    near = np.linalg.norm(unit[:, None] - centres, axis=2).min(axis=1)
    total = near + np.where(unit[:, 0] > 0.5, 0.001, 0)
    total[-2:] = np.inf
    regions = find_regions(unit, total, k_top=3, k_nn=count + 1, delta=0.3)
    assert len(regions) == 2  # three were asked for, and there are no more
    for number, (region, factor) in enumerate(zip(regions, factors, strict=True)):
        np.testing.assert_array_equal(region.mu, centres[number])
        assert (region.members[0], region.loss) == (number, total[number])
        assert not set(region.members) & {len(unit) - 1, len(unit) - 2}
        expected = factor @ factor.T
        np.testing.assert_allclose(region.sigma, expected, atol=0.06 * expected.max())


@given(seed=st.integers(0, 10**6), dimension=st.integers(2, 8))
def test_a_ball_has_the_determinant_of_its_ellipsoid(seed: int, dimension: int) -> None:
    factor = np.random.default_rng(seed).normal(size=(dimension, dimension))
    sigma = regularised(factor @ factor.T)
    ball = isotropic(sigma)
    np.testing.assert_array_equal(ball, ball[0, 0] * np.eye(dimension))
    np.testing.assert_allclose(np.linalg.det(ball), np.linalg.det(sigma), rtol=1e-9)


def test_a_method_may_ask_for_regions_of_its_own() -> None:
    """As many as `optimizer` says unless the method says so, and balls where it asks for them."""
    rng = np.random.default_rng(1)
    evaluations = SimpleNamespace(unit=rng.random((80, 3)), total=rng.random(80))
    optimizer = SimpleNamespace(k_top=4, k_nn=15, delta=0.1)
    results = []
    for k_top, covariance, count in ((None, True, 4), (2, False, 2)):
        method = SimpleNamespace(k_top=k_top, covariance=covariance)
        regions = module.regions_of(method, optimizer, evaluations)
        assert len(regions) == count
        results.append(regions)
    for ellipsoid, ball in zip(*results, strict=False):
        np.testing.assert_array_equal(ball.mu, ellipsoid.mu)
        np.testing.assert_array_equal(ball.sigma, isotropic(ellipsoid.sigma))
        assert np.ptp(np.linalg.eigvalsh(ellipsoid.sigma)) > 0


def test_a_history_that_failed_has_no_regions() -> None:
    total = np.full(9, np.inf)
    with pytest.raises(UserError, match="only 0 of 9 simulations succeeded"):
        find_regions(np.random.default_rng(1).random((9, 2)), total, k_top=2, k_nn=6, delta=0.1)


@given(
    unit=arrays(float, st.tuples(st.integers(2, 20), st.integers(1, 6)), elements=COARSE),
    delta=st.floats(1e-3, 2),
    k_top=st.integers(1, 50),
    k_nn=st.integers(6, 30),
    data=st.data(),
)
def test_regions_of_any_history(unit, delta: float, k_top: int, k_nn: int, data) -> None:
    """Equal points and losses, failures, more neighbours than points, one axis: all can start."""
    losses = st.sampled_from([1.0, 2.0, 3.0, np.inf])
    total = np.array(data.draw(st.lists(losses, min_size=len(unit), max_size=len(unit))))
    total[:2] = 1.5, 2.5
    good = np.isfinite(total)
    regions = find_regions(unit, total, k_top=k_top, k_nn=k_nn, delta=delta)
    assert 1 <= len(regions) <= k_top
    assert regions[0].loss == total.min()
    for number, region in enumerate(regions):
        assert np.linalg.eigvalsh(region.sigma).min() > 0
        assert len(set(region.members)) == min(k_nn, good.sum())
        assert good[region.members].all()
        np.testing.assert_array_equal(unit[region.members[0]], region.mu)
        for better in regions[:number]:
            assert better.loss <= region.loss
            assert np.linalg.norm(better.mu - region.mu) > delta
