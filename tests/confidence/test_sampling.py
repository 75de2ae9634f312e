"""Surrogate, sampler and intervals against linear algebra and known distributions."""

import numpy as np
import pytest

from pipeline.confidence.axes import Axes
from pipeline.confidence.ensemble import sample
from pipeline.confidence.intervals import correlation, identifiable, interval
from pipeline.confidence.surrogate import Surrogate, monomials
from pipeline.params import load
from pipeline.params.identification import Prior
from tests.confidence.toy import SPACE, TRUTH
from tests.project import ROOT


def walkers(log_density, start, seed: int = 1) -> np.ndarray:
    drawn = sample(log_density, start, steps=1500, keep=1000, rng=np.random.default_rng(seed))
    return drawn.reshape(-1, start.shape[1])


def test_samples_of_a_correlated_gaussian() -> None:
    """Two scales that are 1000 apart, correlation 0.99."""
    factor = np.array([[1000.0, 0], [0.99, np.sqrt(1 - 0.99**2)]])
    inverse = np.linalg.inv(factor @ factor.T)

    def log_density(x):
        return -0.5 * np.einsum("ni,ij,nj->n", x, inverse, x)

    start = np.random.default_rng(0).normal(size=(100, 2))
    drawn = walkers(log_density, start)
    np.testing.assert_allclose(np.cov(drawn.T), factor @ factor.T, rtol=0.1)
    assert np.all(np.abs(drawn.mean(axis=0)) < 0.05 * drawn.std(axis=0))


def test_samples_end_at_the_box() -> None:
    """A Gaussian at the face of a box: half of it is left, with known 5 % and 95 % points."""

    def log_density(x):
        return np.where(np.all((x >= 0) & (x <= 8), axis=1), -0.5 * (x**2).sum(axis=1), -np.inf)

    start = np.abs(np.random.default_rng(0).normal(size=(100, 2)))
    drawn = walkers(log_density, start)
    assert drawn.min() >= 0
    for column in drawn.T:  # of |N(0, 1)|
        np.testing.assert_allclose(interval(column), [0.0627, 1.960], atol=0.04)


def linear(rng: np.random.Generator, count: int = 60):
    """Residuals c + A z + B n + prior of n, and a design to fit them by."""
    a, b, c = rng.normal(size=(3, count)), rng.normal(size=(3, count)), rng.normal(size=count)
    z, shifted = rng.normal(size=(64, 3)), np.repeat([[1.0], [-1.0]], 32, axis=0)
    residuals = c + z @ a + shifted @ b[:1]
    precision, centre = np.array([4.0, 1.0, 0.25]), np.array([0.3, 0.0, -1.0])
    return a, b, c, Surrogate(z, shifted, residuals, b[1:], precision, centre)


def test_nuisances_are_marginalised_exactly() -> None:
    """Against the joint normal equations of parameters and nuisances."""
    rng = np.random.default_rng(3)
    a, b, c, surrogate = linear(rng)
    weight = rng.uniform(0.5, 2, len(c))
    surrogate.weigh(weight)
    both = np.concatenate([a, b])
    prior, centre = np.diag([0, 0, 0, 4.0, 1.0, 0.25]), np.array([0, 0, 0, 0.3, 0.0, -1.0])
    matrix = (both * weight) @ both.T + prior
    best = np.linalg.solve(matrix, prior @ centre - (both * weight) @ c)

    def total(x):
        return ((c + x @ both) ** 2) @ weight + (x - centre) @ prior @ (x - centre)

    points = rng.normal(size=(5, 3))
    mean, covariance = surrogate.nuisances(points)
    expected = [total(np.concatenate([z, n])) for z, n in zip(points, mean, strict=True)]
    np.testing.assert_allclose(surrogate.misfit(points), expected, rtol=1e-8)
    np.testing.assert_allclose(surrogate.least(c + points @ a, weight), expected, rtol=1e-8)
    np.testing.assert_allclose(surrogate.nuisances(best[None, :3])[0][0], best[3:], atol=1e-8)
    np.testing.assert_allclose(surrogate.misfit(best[None, :3]), total(best), rtol=1e-8)
    np.testing.assert_allclose(covariance, np.linalg.inv(matrix[3:, 3:]), atol=1e-8)
    np.testing.assert_allclose(surrogate.residual(best[:3]), c + best @ both, atol=1e-8)


def test_a_quadratic_is_reproduced_and_a_cubic_is_known_to_be_off() -> None:
    rng = np.random.default_rng(4)
    coefficients = rng.normal(size=(10, 30))
    z = rng.normal(size=(80, 3))
    none = np.zeros((80, 0)), np.zeros((0, 30))
    exact = Surrogate(z, none[0], monomials(z) @ coefficients, none[1])
    np.testing.assert_allclose(exact.coefficients, coefficients, atol=1e-9)
    assert np.abs(exact.left).max() < 1e-9
    rough = rng.normal(0, 0.1, (80, 30))
    noisy = Surrogate(z, none[0], monomials(z) @ coefficients + rough, none[1])
    np.testing.assert_allclose((noisy.left**2).sum(axis=0).mean(), 0.01, rtol=0.15)


def test_an_interval_that_fills_the_box_identifies_nothing() -> None:
    axes = Axes(SPACE, TRUTH)
    rng = np.random.default_rng(5)
    for name, low, high in (("youngs_modulus", 3e4, 1e7), ("dynamic_friction", 0.05, 1.0)):
        column = SPACE.names.index(name)
        unit = np.tile(SPACE.to_unit(TRUTH), (2000, 1))
        unit[:, column] = rng.random(2000)
        assert not identifiable(name, *interval(SPACE.to_physical(unit)[:, column]), axes)
        assert identifiable(name, np.sqrt(low * high), 1.2 * np.sqrt(low * high), axes)


def test_correlations() -> None:
    rng = np.random.default_rng(6)
    a, b = rng.normal(size=(2, 50_000))
    found = correlation({"a": 3 + a, "b": -1e5 * (0.6 * a + 0.8 * b), "still": 0 * a})
    assert found["names"] == ["a", "b", "still"]
    np.testing.assert_allclose(found["matrix"], [[1, -0.6, 0], [-0.6, 1, 0], [0, 0, 1]], atol=0.02)


@pytest.mark.parametrize(
    "fixed", [set(), {"damping_scale"}, {"poissons_ratio", "dynamic_friction"}]
)
def test_even_coordinates_come_back(fixed) -> None:
    axes = Axes(SPACE, TRUTH, fixed)
    unit = np.random.default_rng(7).random((50, 5))
    theta = SPACE.to_physical(0.01 + 0.98 * unit)
    theta[:, [SPACE.names.index(name) for name in fixed]] = TRUTH[
        [SPACE.names.index(name) for name in fixed]
    ]
    even = axes.even(theta)
    assert even.shape == (50, 5 - len(fixed))
    np.testing.assert_allclose(axes.physical(even), theta, rtol=1e-9)
    assert axes.inside(theta).all()
    np.testing.assert_allclose(axes.clipped(even), even, rtol=1e-9)
    beyond = axes.clipped(even + 50.0)
    assert axes.inside(axes.physical(beyond)).all()


def test_the_prior_is_that_of_the_box() -> None:
    """Samples of the coordinates by their volume are uniform on the axes of the search."""
    axes = Axes(SPACE, TRUTH)

    def log_density(even):
        theta = axes.physical(even)
        return np.where(axes.inside(theta), axes.log_volume(theta), -np.inf)

    start = axes.even(SPACE.to_physical(0.2 + 0.6 * np.random.default_rng(8).random((100, 5))))
    unit = SPACE.to_unit(axes.physical(walkers(log_density, start)))
    for column in unit.T:
        np.testing.assert_allclose(
            np.quantile(column, [0.05, 0.5, 0.95]), [0.05, 0.5, 0.95], atol=0.05
        )


def test_a_searched_drag_is_an_axis_and_other_nuisances_are_none() -> None:
    """Its values are the coordinate itself; the method's bounds are the box, its prior counts."""
    params = load(ROOT / "params.yaml")
    about = params.methods["sling2sim2real_taut"]
    nuisances = {"air_drag": (0.0, 8.0), "force_bias_x": (-1.0, 1.0)}
    priors = dict.fromkeys(nuisances, Prior(mean=4.0, weight=1.0))
    about = about.model_copy(
        update={"nuisances": nuisances, "priors": priors, "bounds": {"poissons_ratio": (0.4, 0.45)}}
    )
    params = params.model_copy(update={"methods": {"own": about}})
    content = {
        "theta": dict(zip(SPACE.names, TRUTH, strict=True)),
        "nuisances": {"air_drag": 3.0, "force_bias_x": 0.2},
    }
    axes = Axes.of_method(params, "own", content, 0.0)
    assert axes.names == (*SPACE.names, "air_drag")
    np.testing.assert_array_equal(axes.theta, [*TRUTH, 3.0])
    assert (axes.low[1], axes.high[1], axes.low[5], axes.high[5]) == (0.4, 0.45, 0.0, 8.0)
    points = np.array([[*TRUTH, drag] for drag in (0.0, 2.0, 7.5)])
    even = axes.even(points)
    np.testing.assert_array_equal(even[:, 5], [0.0, 2.0, 7.5])
    np.testing.assert_allclose(axes.physical(even), points)
    np.testing.assert_allclose(axes.space.log_prior(points), [0.0, -0.5, -1.875])
    assert axes.inside(points).all() and not axes.inside(points + [0, 0, 0, 0, 0, 9.0]).any()
    assert identifiable("air_drag", 1.0, 2.0, axes) and not identifiable("air_drag", 0.5, 7.5, axes)
