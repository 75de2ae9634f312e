"""Residuals around a point, whitened, and what nuisances leave of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sling2sim2real.identification.posterior.residuals import Residuals

NO_AUTOCORRELATION = 0.05  # an autocorrelation that is none


@dataclass(frozen=True)
class Linearised:
    """Residuals over their spread at a point, and how they change: what evidence is to the fit.

    Attributes:
        residual: Shape (Q,); its squares add up to the misfit.
        slopes, nuisance_slopes: With D coordinates and I nuisances, shapes (Q, D) and (Q, I).
        uncounted: What of the loss factor's slope does not count, shape (Q,).
    """

    residual: np.ndarray
    slopes: np.ndarray
    nuisance_slopes: np.ndarray
    uncounted: np.ndarray

    @property
    def misfit(self) -> float:
        """-2 log p, the nuisances as they are."""
        return float(self.residual @ self.residual)

    @cached_property
    def _factors(self) -> tuple[np.ndarray, np.ndarray]:
        """Orthonormal basis (Q, I) of what the nuisances do, and the triangle (I, I)."""
        basis, triangle = np.linalg.qr(self.nuisance_slopes)
        return basis, triangle

    def cleared(self, vectors: np.ndarray) -> np.ndarray:
        """What the nuisances leave of vectors (N, Q): least squares."""
        basis, _ = self._factors
        return vectors - (vectors @ basis) @ basis.T

    @cached_property
    def hessian(self) -> np.ndarray:
        """The least over n of |residual + slopes d + nuisance_slopes n|^2 is
        const - 2 gradient d + d' hessian d; shape (D, D).
        """
        slopes = self.cleared(self.slopes.T)
        return slopes @ slopes.T

    @cached_property
    def gradient(self) -> np.ndarray:
        """As `hessian`, shape (D,)."""
        return -self.slopes.T @ self.cleared(self.residual[None])[0]

    @cached_property
    def nuisance_change(self) -> np.ndarray:
        """How the best n changes with the coordinates, shape (I, D)."""
        basis, triangle = self._factors
        return -np.linalg.solve(triangle, basis.T @ self.slopes)

    @cached_property
    def nuisance_spread(self) -> np.ndarray:
        """Standard deviations of n, given the coordinates, shape (I,)."""
        _, triangle = self._factors
        return np.linalg.norm(np.linalg.inv(triangle), axis=1)


@dataclass(frozen=True)
class Form:
    """What of a recording's density stays as it is within a pass of the fit.

    Attributes:
        residuals: In their bins, R of them.
        weight: One over the spread of each, shape (R,).
        basis: Orthonormal, of what the M linear nuisances do to the residuals and to their own
            priors, shape (R + M, M).
    """

    residuals: Residuals
    weight: np.ndarray
    basis: np.ndarray

    @classmethod
    def of(cls, residuals: Residuals, weight: np.ndarray, linear: np.ndarray) -> Form:
        """Make it of the nuisances' columns (M, R), each in units of its tolerance."""
        effects = np.vstack([(linear * weight).T, np.eye(len(linear))])
        return cls(residuals, weight, np.linalg.qr(effects)[0])

    def whitened(self, vectors: np.ndarray) -> np.ndarray:
        """Residuals (N, R) without what linear nuisances explain, shape (N, R + M).

        Their squares add up to the least of |residuals / spread|^2 + |m|^2 over those nuisances m.
        """
        priors = np.zeros((len(vectors), self.basis.shape[1]))
        gaps = np.concatenate([vectors * self.weight, priors], axis=1)
        return gaps - (gaps @ self.basis) @ self.basis.T


@dataclass(frozen=True)
class Expansion(Linearised):
    """A recording's, with its simulated nuisances, whose own priors are the last rows.

    The linear nuisances are at their best.

    Attributes:
        form: Of the density.
        origin: The logarithm of the loss factor there.
    """

    form: Form
    origin: float

    @classmethod
    def of(
        cls,
        form: Form,
        here: np.ndarray,
        slopes: np.ndarray,
        nuisance_slopes: np.ndarray,
        uncounted: np.ndarray,
        priors: np.ndarray,
        prior_slopes: np.ndarray,
        *,
        origin: float,
    ) -> Expansion:
        """Make it of residuals (R,), their slopes (D, R), (3, R) and (R,), and n's priors (3,)."""

        def rows(vectors: np.ndarray, priors: np.ndarray | None = None) -> np.ndarray:
            none = np.zeros((len(vectors), len(prior_slopes)))
            return np.hstack([form.whitened(vectors), none if priors is None else priors]).T

        return cls(
            rows(here[None], priors[None])[:, 0],
            rows(slopes),
            rows(nuisance_slopes, np.diag(prior_slopes)),
            rows(uncounted[None])[:, 0],
            form,
            origin,
        )

    @property
    def _residuals(self) -> np.ndarray:
        """What the linear nuisances leave [N, m], shape (R,)."""
        return self.residual[: len(self.form.weight)] / self.form.weight

    @property
    def _bins(self) -> np.ndarray:
        """Of it depth and side of the bins [m], shape (2, M)."""
        residuals = self.form.residuals
        return self._residuals[3 * len(residuals.samples) :].reshape(2, -1)

    def rms(self, part: str) -> float:
        """Root mean square of what is left of force [N], held or recoil [m]; 0 of nothing."""
        residuals = self.form.residuals
        recoils = residuals.recoils
        force = self._residuals[: 3 * len(residuals.samples)]
        parts = {"force": force, "held": self._bins[:, ~recoils], "recoil": self._bins[:, recoils]}
        return float(np.sqrt(np.mean(parts[part] ** 2))) if parts[part].size else 0.0

    @property
    def discrepancy(self) -> float:
        """Standard deviation of a sample of the force [N], were samples independent.

        Of what is left of it along the axis where that is most: the root mean square times the root
        of the number of samples in which it repeats itself (integrated autocorrelation time). What
        a law gets wrong of a pull lasts for seconds.
        """
        count = len(self.form.residuals.samples)
        return max(_repeated(axis) for axis in self._residuals[: 3 * count].reshape(3, count))

    @property
    def recoil_discrepancy(self) -> float:
        """The same of the recoil, as a share of how far the middle has travelled.

        That of the picture where it is most.
        What a law gets wrong of a recoil moves all of a picture's points together.
        """
        seen, bins = self.form.residuals, self._bins
        travelled = seen.travelled()
        pictures = [seen.picture == picture for picture in np.unique(seen.picture[seen.recoils])]
        return max(
            (
                _repeated(bins[axis, picture]) / travelled[picture][0]
                for picture in pictures
                for axis in (0, 1)
            ),
            default=0.0,
        )

    @property
    def pictures(self) -> list[float]:
        """Times of the pictures in which the recoil is seen, from the release [s]."""
        residuals = self.form.residuals
        seen, episode = residuals.picture[residuals.recoils], residuals.episode
        return (episode.cloud_time[np.unique(seen)] - episode.release_time).tolist()


def _repeated(samples: np.ndarray) -> float:
    """Root mean square of samples (S,), times the root of their autocorrelation time in samples."""
    size = samples @ samples
    if not size:
        return 0.0
    alike = np.correlate(samples, samples, "full")[len(samples) :] / size
    ends = np.flatnonzero(alike < NO_AUTOCORRELATION)
    time = 1 + 2 * alike[: ends[0] if len(ends) else len(alike)].sum()
    return float(np.sqrt(size / len(samples) * time))
