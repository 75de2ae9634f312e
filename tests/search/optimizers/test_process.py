"""The Gaussian process against BoTorch's SingleTaskGP, of the same kernel and priors."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from botorch.models import SingleTaskGP
from botorch.models.utils.gpytorch_modules import get_covar_module_with_dim_scaled_prior
from gpytorch.mlls import ExactMarginalLogLikelihood

from pipeline.search.optimizers.process import Hyperparameters, Process, fitted, log_density

COUNT, DIMENSION = 60, 3
ABOUT = Hyperparameters(np.array([0.3, 1.1, 0.7]), 0.2, 0.01)


def data() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    unit = rng.random((COUNT, DIMENSION))
    unit[7] = unit[8]  # a point that was evaluated twice
    return unit, np.abs(unit - 0.4) @ [3.0, 1.0, 0.2] + 0.1 * rng.normal(size=COUNT) - 1


def botorchs(unit: np.ndarray, value: np.ndarray, about: Hyperparameters | None) -> SingleTaskGP:
    kernel = get_covar_module_with_dim_scaled_prior(unit.shape[1], use_rbf_kernel=False)
    kernel.nu = 0.5
    points, values = torch.from_numpy(unit), torch.from_numpy(value)[:, None]
    model = SingleTaskGP(points, values, covar_module=kernel, outcome_transform=None)
    if about is not None:
        kernel.lengthscale = torch.from_numpy(about.lengths)
        model.mean_module.constant = about.mean
        model.likelihood.noise = about.noise
    return model


def test_the_usual_hyperparameters_are_botorchs() -> None:
    model, usual = botorchs(*data(), None), Hyperparameters.usual(DIMENSION)
    np.testing.assert_allclose(model.covar_module.lengthscale[0].detach(), usual.lengths)
    assert model.likelihood.noise.item() == pytest.approx(usual.noise)
    assert model.mean_module.constant.item() == usual.mean


@pytest.mark.parametrize("about", [ABOUT, Hyperparameters.usual(DIMENSION)])
def test_density_and_gradient_are_botorchs(about: Hyperparameters) -> None:
    unit, value = data()
    model = botorchs(unit, value, about)
    likelihood = ExactMarginalLogLikelihood(model.likelihood, model)
    expected = COUNT * likelihood(model(model.train_inputs[0]), model.train_targets)
    expected.backward()
    slopes = [
        model.covar_module.raw_lengthscale.grad[0],
        model.mean_module.raw_constant.grad[None],
        model.likelihood.noise_covar.raw_noise.grad,
    ]
    density, slope = log_density(unit, value, about.vector)
    assert density == pytest.approx(expected.item(), rel=1e-7)
    np.testing.assert_allclose(slope, torch.cat(slopes), rtol=1e-6)


def test_predictions_and_slopes_are_botorchs() -> None:
    """Jointly, at training points too; slopes of any sum of what is predicted."""
    unit, value = data()
    rng = np.random.default_rng(2)
    points = rng.random((6, DIMENSION))
    by_mean, by_covariance = torch.from_numpy(rng.normal(size=6)), rng.normal(size=(6, 6))
    by_covariance = torch.from_numpy(by_covariance + by_covariance.T)
    model, process = botorchs(unit, value, ABOUT).eval(), Process(unit, value, ABOUT)

    free = torch.tensor(points, requires_grad=True)
    expected = model.posterior(free).distribution
    mean, covariance = expected.mean, expected.covariance_matrix
    ((mean * by_mean).sum() + (covariance * by_covariance).sum()).backward()
    guess = process.at(torch.from_numpy(points))
    np.testing.assert_allclose(guess.mean, mean.detach(), rtol=1e-6)
    np.testing.assert_allclose(guess.covariance, covariance.detach(), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(guess.slope(by_mean, by_covariance), free.grad, rtol=1e-6)

    points[0] = unit[3]
    expected = model.posterior(torch.from_numpy(points)).distribution
    guess = process.at(torch.from_numpy(points))
    np.testing.assert_allclose(guess.covariance, expected.covariance_matrix.detach(), atol=1e-7)
    assert torch.isfinite(guess.slope(by_mean, by_covariance)).all()


def test_a_fit_climbs_to_where_the_gradient_is_none() -> None:
    unit, value = data()
    best = fitted(unit, value, Hyperparameters.usual(DIMENSION), 200)
    density, slope = log_density(unit, value, best.vector)
    assert density > log_density(unit, value, Hyperparameters.usual(DIMENSION).vector)[0]
    np.testing.assert_allclose(slope, 0, atol=0.01)
    assert best.lengths.argmax() == 2  # the axis that matters least
    short = fitted(unit, value, Hyperparameters.usual(DIMENSION), 1)
    assert log_density(unit, value, short.vector)[0] < density
