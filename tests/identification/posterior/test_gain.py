"""Gains against brute force: joint Gaussians, and least squares over the evidence itself."""

import numpy as np
import pytest

from sling2sim2real.identification.posterior.gain import LandingModel, unknowns
from sling2sim2real.identification.posterior.launches import TAPE
from tests.identification.posterior.toy_landings import (
    COVARIANCE,
    GRADIENT,
    NAMES,
    RNG,
    landing_model,
)


@pytest.fixture
def model() -> LandingModel:
    return landing_model()


def conditioned(covariance, given: list[int], rest: list[int]) -> np.ndarray:
    """The covariance of `rest` given `given`, by the precision: another way than ours."""
    both = [*rest, *given]
    precision = np.linalg.inv(covariance[np.ix_(both, both)])
    return np.linalg.inv(precision[: len(rest), : len(rest)])


def test_a_launch_narrows_as_the_joint_gaussian_of_landings_says(model) -> None:
    """Landings, and measured ones with errors of their own, as one Gaussian of all."""
    for count in (1, 5):
        rows = np.vstack([GRADIENT, *[GRADIENT[:1]] * count])
        joint = rows @ COVARIANCE @ rows.T
        joint += np.diag([1e-12, 1e-12, *[model.draw[0] ** 2 + TAPE**2] * count])
        left = conditioned(joint, list(range(2, 2 + count)), [0, 1])
        expected = 1.645 * np.sqrt(np.diag(left) + model.draw**2)
        half_widths = model.after(model.launched(0, TAPE, count))
        np.testing.assert_allclose(half_widths, expected, rtol=1e-5)
        assert (half_widths < model.half_width).all()


def test_knowing_some_exactly(model) -> None:
    left = conditioned(COVARIANCE, [1, 3], [0, 2])
    spread = np.einsum("td,de,te->t", GRADIENT[:, [0, 2]], left, GRADIENT[:, [0, 2]])
    expected = 1.645 * np.sqrt(spread + model.draw**2)
    half_widths = model.after(model.known("elasticity_damping", "air_drag", "unknown"))
    np.testing.assert_allclose(half_widths, expected, rtol=1e-9)


def test_an_exact_arm_leaves_what_the_samples_spread(model) -> None:
    expected = np.sqrt(np.einsum("td,de,te->t", GRADIENT, COVARIANCE, GRADIENT)) * 1.645
    np.testing.assert_allclose(model.after(draw=0.0), expected, rtol=1e-9)


def test_a_model_is_read_off_samples() -> None:
    """Landings that are exactly linear in the logarithms are given back."""
    centre = np.array([2e5, 2e-3, 1.0, 0.5])
    phi = RNG.multivariate_normal(np.zeros(4), COVARIANCE, size=500)
    samples = np.exp(phi) * centre
    samples[:, 3] = 0.5 + phi[:, 3]  # no logarithm
    samples = np.column_stack([samples, np.full(500, 0.47)])
    some = RNG.choice(500, 60, replace=False)  # whichever they are
    landings = 1.9 + GRADIENT @ phi[some].T
    draw, half_width = np.array([0.02, 0.03]), np.array([0.1, 0.11])
    names = [*NAMES, "poissons_ratio"]
    model = LandingModel.of(names, samples, some, landings, draw, half_width)
    assert model.names == NAMES and list(unknowns(names, samples)) == NAMES
    np.testing.assert_allclose(model.gradient, GRADIENT, atol=1e-9)
    np.testing.assert_allclose(model.covariance, np.cov(phi.T), atol=1e-9)
    assert LandingModel.of(names, samples, some, landings, draw, np.array([np.nan, 0.1])) is None
    assert LandingModel.of([], np.zeros((0, 0)), some, landings, draw, half_width) is None
