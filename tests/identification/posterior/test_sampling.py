"""Samples of densities, against integrals over grids, and within bounds against SciPy."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.random import RandomState
from scipy import stats

from sling2sim2real.identification.posterior import sampling
from sling2sim2real.identification.posterior.fit import Fit
from sling2sim2real.identification.posterior.sampling import (
    SAMPLES,
    QuadraticSurface,
    samples_of,
    truncated_gaussian,
)
from tests.identification.posterior.toy import SIZE, space

AT, PRODUCT, RATHER = np.array([20.0, 10.0, 0.0]), 0.03, 0.25  # the mode, and two deviations
LEVELS = 0.05, 0.5, 0.95


def residuals(x: np.ndarray) -> np.ndarray:
    """A product is known well, its first factor hardly, the third coordinate by its prior alone."""
    product = (x[:, 0] * x[:, 1] / np.prod(AT[:2]) - 1) / PRODUCT
    return np.stack([product, (x[:, 0] / AT[0] - 1) / RATHER, 0 * product], axis=1)


SLOPES = np.array([[1 / PRODUCT, 1 / PRODUCT], [1 / RATHER, 0]]) / AT[:2]  # a step, at AT


def target(seen=residuals, slopes=SLOPES) -> SimpleNamespace:
    """What `Remaining` is of a fit at AT, with a half-normal of 5 steps as the last prior."""
    precision = np.array([0.0, 0.0, (5 * SIZE[2]) ** -2])
    coordinates = replace(space(), precision=precision)
    slope = np.pad(slopes, ((0, 0), (0, 1))) / SIZE
    hessian = slope.T @ slope + np.diag(coordinates.precision)
    nothing: Any = None  # else
    there = AT * SIZE, np.zeros((0, 3)), [], None, nothing
    fitted = Fit(*there, hessian, gradient=np.zeros(3), steps=1, settled=True)

    class Evidence(SimpleNamespace):
        def __call__(self, phi: np.ndarray) -> np.ndarray:
            return seen(phi / SIZE)

    return Evidence(fitted=fitted, coordinates=coordinates)


@pytest.fixture
def valley() -> SimpleNamespace:
    return target()


def integrated(widened: float = 1.0) -> np.ndarray:
    """Quantiles at LEVELS of the first two coordinates [steps], shape (2, 3), by a grid."""
    first, second = np.meshgrid(np.linspace(0, 50, 2001), np.linspace(0, 50, 2001), indexing="ij")
    seen = residuals(np.stack([first.ravel(), second.ravel(), 0 * first.ravel()], axis=1))
    density = np.exp(-0.5 * np.sum(seen**2, axis=1) / widened**2).reshape(first.shape)
    result = []
    for axis, values in ((1, first[:, 0]), (0, second[0])):
        below = np.cumsum(density.sum(axis=axis))
        result.append(np.interp(LEVELS, below / below[-1], values))
    return np.array(result)


@pytest.mark.parametrize("widened", [1.0, pytest.param(1.3, marks=pytest.mark.slow)])
def test_quantiles_of_a_curved_valley_are_those_of_the_integral(valley, widened):
    """The second factor has a long tail upwards, where the Gaussian is even."""
    (samples, effective, batches), true = samples_of(valley, widened, 3), integrated(widened)
    assert true[1, 2] - true[1, 1] > 1.4 * (true[1, 1] - true[1, 0])  # the long tail
    below = np.mean(samples[:, :2, None] / SIZE[:2, None] < true, axis=0)
    error = np.sqrt(np.multiply(LEVELS, 1 - np.array(LEVELS)) / effective)
    assert np.all(np.abs(below - LEVELS) < 3 * error)
    assert SAMPLES / 2 < effective <= SAMPLES + 1e-6 and 2 <= batches <= sampling.BATCHES
    assert samples.shape == (SAMPLES, 3) and np.all(samples >= 0)


def test_a_coordinate_that_nothing_shows_keeps_its_prior(valley):
    last = samples_of(valley, 1.0, 0)[0][:, 2] / SIZE[2]
    assert np.sqrt(np.mean(last**2)) == pytest.approx(5.0, rel=0.15)


@pytest.mark.parametrize("seen_at", [0.0, 3.0, 12.0])
def test_a_rectified_coordinate_is_exactly_at_its_end_as_often_as_the_integral_says(seen_at):
    """Half of the prior is there; evidence of 2 steps weighs that against the other half."""

    def told(x: np.ndarray) -> np.ndarray:
        return np.column_stack([residuals(x)[:, :2], (np.maximum(x[:, 2], 0) - seen_at) / 2])

    evidence = target(told)
    lowest = np.array([0.0, 0.0, -np.inf])
    evidence.coordinates = replace(evidence.coordinates, lowest=lowest)
    last = samples_of(evidence, 1.0, 1)[0][:, 2] / SIZE[2]
    x = np.linspace(0, 50, 5001)
    above = np.sum(stats.norm.pdf(x, 0, 5) * np.exp(-0.5 * ((x - seen_at) / 2) ** 2)) * x[1]
    at_end = 0.5 * np.exp(-0.5 * (seen_at / 2) ** 2)
    assert last.min() >= 0
    assert np.mean(last == 0) == pytest.approx(at_end / (at_end + above), abs=0.12)


def test_chains_keep_a_normal_density():
    """A thousand ends: the deviation of 11 normal coordinates within 2 %."""
    start = np.random.default_rng(0).normal(size=(1000, 11))
    ends = sampling._evolved(lambda x: -0.5 * np.sum(x**2, axis=1), start, RandomState(0))
    assert ends.std(axis=0).mean() == pytest.approx(1.0, abs=0.02)
    assert np.mean(np.any(ends != start, axis=1)) > 0.99


def test_a_surface_is_exact_of_second_order_and_weights_choose_where_else():
    rng = np.random.default_rng(1)
    x = rng.normal(0, 1, (200, 3))
    centre, scale = np.array([1.0, 2.0, 3.0]), np.array([0.1, 10.0, 1.0])
    even = np.stack([1 + x[:, 0] * x[:, 1], 3 * x[:, 2] - x[:, 2] ** 2], axis=1)
    surface = QuadraticSurface.fitted(centre, scale, centre + scale * x, even, np.ones(200))
    there = rng.normal(0, 1, (50, 3))
    true = (1 + there[:, 0] * there[:, 1]) ** 2 + (3 * there[:, 2] - there[:, 2] ** 2) ** 2
    np.testing.assert_allclose(surface.misfit(centre + scale * there), true, rtol=2e-2, atol=2e-2)
    cubic = x[:, :1] ** 3
    near = np.exp(-2 * np.sum(x**2, axis=1))
    offs = []
    for weight in (np.ones(200), near):
        surface = QuadraticSurface.fitted(centre, scale, centre + scale * x, cubic, weight)
        point = centre + scale * [0.3, 0, 0]
        offs.append(abs(surface.misfit(point[None])[0] - 0.3**6))
    assert offs[1] < offs[0] / 3


def test_weights_take_out_what_no_surface_of_second_order_follows():
    """A fourth power keeps its tails within those of the integral."""

    def steep(x: np.ndarray) -> np.ndarray:
        return np.stack([0.5 * ((x[:, 0] - AT[0]) / 2) ** 2, x[:, 1] - AT[1], 0 * x[:, 0]], axis=1)

    samples, effective, _ = samples_of(target(steep, np.diag([1 / 3, 1.0])), 1.0, 0)
    grid = np.linspace(-12, 12, 4001)
    density = np.exp(-0.5 * (0.5 * (grid / 2) ** 2) ** 2)
    true = np.sqrt(np.sum(density * grid**2) / density.sum())
    assert (samples[:, 0] / SIZE[0]).std() == pytest.approx(true, rel=0.15)
    assert effective > SAMPLES / 4


def test_simulations_that_fail_have_no_density():
    def above(x: np.ndarray) -> np.ndarray:
        return np.where(x[:, :1] > AT[0], np.nan, residuals(x))

    samples, effective, _ = samples_of(target(above), 1.0, 0)
    assert np.all(samples[:, 0] <= AT[0] * SIZE[0]) and 0 < effective < SAMPLES
    samples, effective, _ = samples_of(target(lambda x: np.full((len(x), 2), np.nan)), 1.0, 0)
    assert effective == 0.0 and np.all(np.isfinite(samples))


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
