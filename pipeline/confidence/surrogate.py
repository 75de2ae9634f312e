"""A quadratic in place of the simulator: residuals near a point, from a few dozen rollouts.

    r(z, n) = c + A z + quadratic in z + B n

z are standardised parameters, n nuisances in units of their steps, which enter linearly. So the sum
of weighted squares is f' G f with f = (1, z, z z', n), and n can be minimised away in closed form
(the Schur complement of G), which for Gaussian n is the same as marginalising.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np


def monomials(z: np.ndarray) -> np.ndarray:
    """1, z and z_i z_j (i <= j), shape (N, 1 + D + D (D + 1) / 2)."""
    first, second = _pairs(z.shape[1])
    return np.concatenate([np.ones((len(z), 1)), z, z[:, first] * z[:, second]], axis=1)


@lru_cache
def _pairs(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    return np.triu_indices(dimension)


class Surrogate:
    """Residuals as a quadratic of parameters and linear in nuisances.

    Attributes:
        left: What the quadratic leaves of each rollout, scaled so that left' left is the covariance
            of its error, shape (N, R). As nuisances of unit variance they make up for it.
    """

    def __init__(
        self,
        z: np.ndarray,
        shifted: np.ndarray,
        residuals: np.ndarray,
        columns: np.ndarray,
        precision: np.ndarray | None = None,
        centre: np.ndarray | None = None,
    ) -> None:
        """Fit it.

        Args:
            z: Standardised parameters of the rollouts, shape (N, D).
            shifted: What the rollouts themselves were shifted by, in steps, shape (N, S).
            residuals: Shape (N, R).
            columns: Change of the residuals with the other nuisances, shape (M, R).
            precision: Prior 1/variance of all S + M nuisances; 1 each by default.
            centre: Where their prior lies, from the point of expansion; there by default.
        """
        design = np.concatenate([monomials(z), shifted], axis=1)
        found, *_ = np.linalg.lstsq(design, residuals, rcond=1e-10)
        freedom = max(len(z) - design.shape[1], 1)
        self.left = (residuals - design @ found) / np.sqrt(freedom)
        self.terms = design.shape[1] - shifted.shape[1]
        self.coefficients = np.concatenate([found, columns])  # (P, R)
        others = len(self.coefficients) - self.terms
        precision = np.ones(others) if precision is None else precision
        centre = np.zeros(others) if centre is None else centre
        self._prior = np.zeros((len(self.coefficients),) * 2)
        index = np.arange(self.terms, len(self.coefficients))
        self._prior[index, index] = precision
        self._prior[0, index] = self._prior[index, 0] = -precision * centre
        self._prior[0, 0] = precision @ centre**2

    def weigh(self, weight: np.ndarray) -> None:
        """Take weights (R,) of the squared residuals; before `misfit` and `nuisances`."""
        gram = (self.coefficients * weight) @ self.coefficients.T + self._prior
        n = slice(self.terms, None)
        self._covariance = np.linalg.inv(gram[n, n])
        self._solve = -self._covariance @ gram[n, : self.terms]  # nuisances of (1, z, z z')
        self._reduced = gram[: self.terms, : self.terms] + gram[: self.terms, n] @ self._solve

    def misfit(self, z: np.ndarray) -> np.ndarray:
        """Least sum of weighted squares over the nuisances, their prior included, (N,)."""
        f = monomials(z)
        return ((f @ self._reduced) * f).sum(axis=1)

    def nuisances(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (N, S + M) and covariance of the nuisances given z, in steps from the expansion."""
        return monomials(z) @ self._solve.T, self._covariance

    def residual(self, z: np.ndarray) -> np.ndarray:
        """At one z (D,), with the nuisances at their best, shape (R,)."""
        f = monomials(z[None])
        return (np.concatenate([f, f @ self._solve.T], axis=1) @ self.coefficients)[0]

    def least(self, residuals: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """Weighted squares of other residuals (N, R), the nuisances at their best, shape (N,)."""
        columns = self.coefficients[self.terms :]
        n = slice(self.terms, None)
        inner = (columns * weight) @ columns.T + self._prior[n, n]
        slope = (residuals * weight) @ columns.T + self._prior[0, n]
        square = (residuals**2) @ weight + self._prior[0, 0]
        return square - np.einsum("ni,in->n", slope, np.linalg.solve(inner, slope.T))
