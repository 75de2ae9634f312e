"""A Gaussian process with an exponential kernel, a length scale an axis, for BoTorch.

Covariance, priors, bounds and start are those of BoTorch's own SingleTaskGP with a Matern 1/2
kernel (Hvarfner et al. 2024), which takes twice as long: here the gradient of the likelihood is in
closed form, and a prediction is a few products of matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from botorch.models.model import Model
from botorch.posteriors.gpytorch import GPyTorchPosterior
from gpytorch.distributions import MultivariateNormal
from linear_operator import to_linear_operator
from scipy.optimize import minimize

LEAST_LENGTH, LEAST_NOISE = 0.025, 1e-4  # edges of the cube; variance
SAME = 1e-9  # points nearer to each other than this have no direction, in length scales
LOG_TURN = float(np.log(2 * np.pi))
NOISE_PRIOR = -4.0, 1.0  # of the log of the variance: mean, deviation


@dataclass(frozen=True)
class Hyperparameters:
    """What a process is fitted by.

    Attributes:
        lengths: In edges of the cube, shape (D,).
        mean: Of the values far from all points.
        noise: Variance of a value about the process.
    """

    lengths: np.ndarray
    mean: float
    noise: float

    @classmethod
    def usual(cls, dimension: int) -> Hyperparameters:
        """The modes of the priors."""
        return cls(np.full(dimension, _mode(*length_prior(dimension))), 0.0, _mode(*NOISE_PRIOR))

    @property
    def vector(self) -> np.ndarray:
        return np.array([*self.lengths, self.mean, self.noise])


def length_prior(dimension: int) -> tuple[float, float]:
    """Mean and deviation of the log of a length scale."""
    return np.sqrt(2) + np.log(dimension) / 2, np.sqrt(3)


def fitted(
    unit: np.ndarray, value: np.ndarray, start: Hyperparameters, steps: int
) -> Hyperparameters:
    """Hyperparameters after `steps` of L-BFGS up their posterior density, from `start`.

    Args:
        unit: Points, shape (N, D).
        value: Theirs, shape (N,).
    """
    dimension = unit.shape[1]
    bounds = [*[(LEAST_LENGTH, None)] * dimension, (None, None), (LEAST_NOISE, None)]

    def loss(vector: np.ndarray) -> tuple[float, np.ndarray]:
        density, slope = log_density(unit, value, vector)
        return -density / len(unit), -slope / len(unit)

    options = {"maxiter": steps}
    best = minimize(loss, start.vector, jac=True, bounds=bounds, method="L-BFGS-B", options=options)
    return Hyperparameters(best.x[:dimension], float(best.x[-2]), float(best.x[-1]))


@torch.no_grad()
def log_density(
    unit: np.ndarray, value: np.ndarray, vector: np.ndarray
) -> tuple[float, np.ndarray]:
    """Log of likelihood times priors of (lengths, mean, noise), (D + 2,), and its gradient.

    -inf where the covariance has no Cholesky factor. Rasmussen and Williams 2006, 5.8 and 5.9.
    """
    points = torch.from_numpy(unit)
    lengths, mean, noise = torch.from_numpy(vector[:-2]), vector[-2], vector[-1]
    count, dimension = unit.shape
    distance = _distance(points / lengths, points / lengths)
    kernel = torch.exp(-distance)
    own = torch.eye(count, dtype=kernel.dtype)
    factor, failed = torch.linalg.cholesky_ex(kernel + noise * own)
    if failed:
        return -np.inf, np.zeros_like(vector)
    inverse = torch.cholesky_inverse(factor)
    residual = torch.from_numpy(value - mean)
    solved = inverse @ residual
    density = -residual @ solved / 2 - factor.diagonal().log().sum() - count * LOG_TURN / 2

    gain = (torch.outer(solved, solved) - inverse) / 2  # slope in the covariance's elements
    distance[distance < SAME] = np.inf
    shared = gain * kernel / distance
    centred = points - points.mean(dim=0)
    # over all pairs, shared times the squared difference along each axis
    squares = 2 * (shared.sum(dim=1) @ centred**2 - (centred * (shared @ centred)).sum(dim=0))
    slope = [squares / lengths**3, solved.sum()[None], gain.trace()[None]]
    prior, rise = _log_normal(vector[:-2], *length_prior(dimension))
    noise_prior, noise_rise = _log_normal(vector[-1:], *NOISE_PRIOR)
    rises = np.concatenate([rise, [0.0], noise_rise])
    return float(density) + prior.sum() + noise_prior.sum(), torch.cat(slope).numpy() + rises


def _distance(first: torch.Tensor, second: torch.Tensor) -> torch.Tensor:
    return torch.cdist(first, second, compute_mode="donot_use_mm_for_euclid_dist")


def _mode(mean: float, deviation: float) -> float:
    """Of a log-normal density."""
    return float(np.exp(mean - deviation**2))


def _log_normal(x: np.ndarray, mean: float, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    """Log density and its slope, of each of x (N,)."""
    log = np.log(x)
    gap = (log - mean) / deviation
    density = -(gap**2) / 2 - log - np.log(deviation * np.sqrt(2 * np.pi))
    return density, -(gap / deviation + 1) / x


class Process(Model):
    """The process of values (N,) at points (N, D), as BoTorch's acquisition functions want it."""

    num_outputs, batch_shape = 1, torch.Size()

    def __init__(self, unit: np.ndarray, value: np.ndarray, about: Hyperparameters) -> None:
        super().__init__()
        self._lengths, self._mean = torch.from_numpy(about.lengths), about.mean
        self._points = torch.from_numpy(unit) / self._lengths
        covariance = torch.exp(-_distance(self._points, self._points))
        own = torch.eye(len(unit), dtype=covariance.dtype)
        factor = torch.linalg.cholesky(covariance + about.noise * own)
        self._whiten = torch.linalg.solve_triangular(factor, own, upper=False).mT.contiguous()
        self._solved = self._whiten @ (torch.from_numpy(value - about.mean) @ self._whiten)

    def posterior(self, X, *_, **__) -> GPyTorchPosterior:  # noqa: N803
        """Of the values without noise at points (..., Q, D), jointly."""
        scaled = X / self._lengths
        across = torch.exp(-_distance(scaled, self._points))
        white = across @ self._whiten
        mean = self._mean + across @ self._solved
        covariance = torch.exp(-_distance(scaled, scaled)) - white @ white.mT
        # an operator of GPyTorch's is factored with jitter, if need be
        return GPyTorchPosterior(MultivariateNormal(mean, to_linear_operator(covariance)))
