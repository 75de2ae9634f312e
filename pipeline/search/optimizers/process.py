"""A Gaussian process with an exponential kernel, a length scale an axis: fit, prediction, slopes.

Covariance, priors, bounds and start are those of BoTorch's SingleTaskGP with a Matern 1/2 kernel
(Hvarfner et al. 2024), the numbers too, for a fraction of its time: all gradients are in closed
form.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
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


def log_density(
    unit: np.ndarray, value: np.ndarray, vector: np.ndarray
) -> tuple[float, np.ndarray]:
    """Log of likelihood times priors of (lengths, mean, noise), (D + 2,), and its gradient.

    -inf where the covariance has no Cholesky factor. Rasmussen and Williams 2006, 5.8 and 5.9.
    """
    points = torch.from_numpy(unit)
    lengths, mean, noise = torch.from_numpy(vector[:-2]), vector[-2], vector[-1]
    distance = _distance(points / lengths, points / lengths)
    kernel = torch.neg(distance).exp_()
    kernel.diagonal().add_(noise)
    factor, failed = torch.linalg.cholesky_ex(kernel)
    if failed:
        return -np.inf, np.zeros_like(vector)
    inverse = torch.cholesky_inverse(factor)
    residual = torch.from_numpy(value - mean)
    solved = inverse @ residual
    density = -residual @ solved / 2 - factor.diagonal().log().sum() - len(unit) * LOG_TURN / 2

    gain = inverse.addr_(solved, solved, beta=-1)  # twice the slope in the covariance's elements
    noise_slope = gain.trace()[None] / 2
    shared = gain.mul_(kernel).div_(_apart(distance))
    centred = (points - points.mean(dim=0)).mT.contiguous()
    # over all pairs, shared times half the squared difference along each axis
    squares = centred**2 @ shared.sum(dim=1) - (centred * (centred @ shared)).sum(dim=1)
    slope = torch.cat([squares / lengths**3, solved.sum()[None], noise_slope]).numpy()
    prior, rise = _log_normal(vector[:-2], *length_prior(unit.shape[1]))
    noise_prior, noise_rise = _log_normal(vector[-1:], *NOISE_PRIOR)
    rises = np.concatenate([rise, [0.0], noise_rise])
    return float(density) + prior.sum() + noise_prior.sum(), slope + rises


def _distance(first: torch.Tensor, second: torch.Tensor) -> torch.Tensor:
    return torch.cdist(first, second, compute_mode="donot_use_mm_for_euclid_dist")


def _apart(distance: torch.Tensor) -> torch.Tensor:
    """Distances, in place, infinite where there is no direction."""
    return torch.threshold_(distance, SAME, np.inf)


def _mode(mean: float, deviation: float) -> float:
    """Of a log-normal density."""
    return float(np.exp(mean - deviation**2))


def _log_normal(x: np.ndarray, mean: float, deviation: float) -> tuple[np.ndarray, np.ndarray]:
    """Log density and its slope, of each of x (N,)."""
    log = np.log(x)
    gap = (log - mean) / deviation
    density = -(gap**2) / 2 - log - np.log(deviation * np.sqrt(2 * np.pi))
    return density, -(gap / deviation + 1) / x


class Process:
    """The process of values (N,) at points (N, D)."""

    def __init__(self, unit: np.ndarray, value: np.ndarray, about: Hyperparameters) -> None:
        self._lengths, self._mean = torch.from_numpy(about.lengths), about.mean
        self._points = torch.from_numpy(unit) / self._lengths
        covariance = torch.exp(-_distance(self._points, self._points))
        covariance.diagonal().add_(about.noise)
        self._inverse = torch.cholesky_inverse(torch.linalg.cholesky(covariance))
        self._solved = self._inverse @ torch.from_numpy(value - about.mean)

    def at(self, unit: torch.Tensor) -> Prediction:
        """Of the values without noise at points (Q, D), jointly."""
        return Prediction(self, unit / self._lengths)


class Prediction:
    """What a process says of Q points.

    Attributes:
        mean: Shape (Q,).
        covariance: Shape (Q, Q).
    """

    def __init__(self, process: Process, scaled: torch.Tensor) -> None:
        self._process, self._scaled = process, scaled
        self._others = torch.cat([process._points, scaled])
        self._distance = _distance(scaled, self._others)
        self._kernel = torch.neg(self._distance).exp_()
        across, own = self._kernel.split([len(process._points), len(scaled)], dim=1)
        self._gain = across @ process._inverse
        self.mean = across @ process._solved + process._mean
        self.covariance = torch.addmm(own, self._gain, across.mT, alpha=-1)

    def slope(self, by_mean: torch.Tensor, by_covariance: torch.Tensor) -> torch.Tensor:
        """A function's slope in the points (Q, D), from its slopes in what is predicted.

        Args:
            by_mean: Its slope in `mean`, shape (Q,).
            by_covariance: In `covariance`, symmetric, shape (Q, Q).
        """
        process = self._process
        across = torch.outer(by_mean, process._solved).addmm_(by_covariance, self._gain, alpha=-2)
        pull = torch.cat([across, 2 * by_covariance], dim=1)  # in the kernel; then a unit of gap
        pull.mul_(self._kernel).div_(_apart(self._distance))
        total = pull.sum(dim=1, keepdim=True)
        return (pull @ self._others).sub_(total * self._scaled).div_(process._lengths)
