"""A recording's -2 log p around a point, its nuisances eliminated; and what is left of it there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.identification.posterior.residuals import Residuals

UNLIKE = 0.05  # an autocorrelation that is none


@dataclass(frozen=True)
class NuisanceProjection:
    """Takes what K nuisances explain out of residuals: least squares, by its QR decomposition.

    Attributes:
        weight: One over the spread of each residual, shape (R,).
        priors: Residuals of the nuisances' own priors, shape (K,).
        basis: Orthonormal, of all that they do to both, shape (R + K, K).
    """

    weight: np.ndarray
    priors: np.ndarray
    basis: np.ndarray

    def __call__(self, residuals: np.ndarray) -> np.ndarray:
        """What is left of residuals (N, R), shape (N, R + K): its squares add up to the misfit."""
        priors = np.broadcast_to(self.priors, (len(residuals), len(self.priors)))
        gaps = np.concatenate([residuals * self.weight, priors], axis=1)
        return gaps - (gaps @ self.basis) @ self.basis.T


@dataclass(frozen=True)
class Expansion:
    """-2 log p of a recording around (phi, n), its nuisances eliminated.

    Attributes:
        misfit: There, with the linear nuisances at their best.
        hessian, gradient: misfit + const - 2 gradient d + d' hessian d for d in phi, (D, D), (D,).
        nuisances: Best change of the simulated ones, and its change with d, (3,), (3, D).
        spread: Standard deviations of the simulated ones, given phi, (3,).
        residuals, left: What was compared, and what of it is left at d = 0, shape (R,).
        elimination: Takes the nuisances out of other residuals too.
        uncounted: What the loss factor does to the force, which does not count, shape (R,): from
            `origin` on, the logarithm of the loss factor where a pass of the fit began.
    """

    misfit: float
    hessian: np.ndarray
    gradient: np.ndarray
    nuisances: tuple[np.ndarray, np.ndarray]
    spread: np.ndarray
    residuals: Residuals
    left: np.ndarray
    elimination: NuisanceProjection
    uncounted: np.ndarray
    origin: float

    def rms(self, part: str) -> float:
        """Root mean square of what is left of force [N], held or recoil [m]; 0 of nothing."""
        count = len(self.left) - 2 * len(self.residuals.picture)
        bins, recoils = self.left[count:].reshape(2, -1), self.residuals.recoils
        parts = {"force": self.left[:count], "held": bins[:, ~recoils], "recoil": bins[:, recoils]}
        return float(np.sqrt(np.mean(parts[part] ** 2))) if parts[part].size else 0.0

    @property
    def discrepancy(self) -> float:
        """Standard deviation of a sample of the force [N], were samples independent.

        Of what is left of it along the axis where that is most: the root mean square times the root
        of the number of samples in which it repeats itself (integrated autocorrelation time). What
        a law gets wrong of a pull lasts for seconds.
        """
        count = len(self.residuals.samples)
        return max(_repeated(axis) for axis in self.left[: 3 * count].reshape(3, count))

    @property
    def recoil_discrepancy(self) -> float:
        """The same of the recoil, as a share of the way gone; that of the picture where it is most.

        What a law gets wrong of a recoil moves all of a picture's points together.
        """
        seen, count = self.residuals, len(self.left) - 2 * len(self.residuals.picture)
        bins, gone = self.left[count:].reshape(2, -1), seen.gone()
        pictures = [seen.picture == picture for picture in np.unique(seen.picture[seen.recoils])]
        return max(
            (
                _repeated(bins[axis, picture]) / gone[picture][0]
                for picture in pictures
                for axis in (0, 1)
            ),
            default=0.0,
        )

    @property
    def pictures(self) -> list[float]:
        """Times of the pictures in which the recoil is seen, from the release [s]."""
        seen, episode = self.residuals.picture[self.residuals.recoils], self.residuals.episode
        return (episode.cloud_time[np.unique(seen)] - episode.release_time).tolist()


def _repeated(left: np.ndarray) -> float:
    """Root mean square of samples (S,), times the root of their autocorrelation time in samples."""
    size = left @ left
    if not size:
        return 0.0
    alike = np.correlate(left, left, "full")[len(left) :] / size
    ends = np.flatnonzero(alike < UNLIKE)
    time = 1 + 2 * alike[: ends[0] if len(ends) else len(alike)].sum()
    return float(np.sqrt(size / len(left) * time))
