"""Gain of knowing more: how much the interval of a landing would narrow.

Near the mode a landing is linear in what is not known, which is Gaussian: both as the samples of
the posterior have them. A launch, or knowing some parameters exactly, then changes the covariance
by plain algebra.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.parameters import TABLE, Parameter

LEAST_RANGE = 1e-9  # of a column that the samples vary


@dataclass(frozen=True)
class LandingModel:
    """T landings of D unknowns.

    Attributes:
        names: Of the unknowns, length D.
        covariance: Of the unknowns, shape (D, D).
        gradient: Of the landings in the unknowns [m], shape (T, D).
        draw: Standard deviation of the landings by the draw's error [m], shape (T,).
        half_width: Of the landings' intervals [m], shape (T,).
    """

    names: list[str]
    covariance: np.ndarray
    gradient: np.ndarray
    draw: np.ndarray
    half_width: np.ndarray

    @classmethod
    def of(
        cls,
        names: Sequence[str],
        samples: np.ndarray,
        chosen: np.ndarray,
        landings: np.ndarray,
        draw: np.ndarray,
        half_width: np.ndarray,
    ) -> LandingModel | None:
        """Fit the model to samples (M, P) of θ and the landings (T, S) of some of them.

        None without unknowns, with a half width that is not finite, or with too few landings.

        Args:
            names: Of the columns of `samples`.
            chosen: Numbers of the samples that landed there, shape (S,).
            draw, half_width: As the attributes.
        """
        good = np.isfinite(landings).all(axis=0)
        unknown = unknowns(names, samples)
        if not unknown or not np.isfinite(half_width).all() or good.sum() < 2 * len(unknown):
            return None
        columns = np.stack(list(unknown.values()), axis=1)
        some = chosen[good]
        design = np.column_stack([np.ones(len(some)), columns[some] - columns.mean(axis=0)])
        gradient = np.linalg.lstsq(design, landings[:, good].T, rcond=None)[0][1:].T
        covariance = np.atleast_2d(np.cov(columns.T))
        return cls(list(unknown), covariance, gradient, draw, half_width)

    def after(self, covariance: np.ndarray | None = None, draw: float = 1.0) -> np.ndarray:
        """Half widths [m], shape (T,), with another covariance and a share of the draw's error."""

        def variance(covariance: np.ndarray, draw: float) -> np.ndarray:
            spread = np.einsum("td,de,te->t", self.gradient, covariance, self.gradient)
            return spread + (draw * self.draw) ** 2

        then = variance(self.covariance if covariance is None else covariance, draw)
        return self.half_width * np.sqrt(then / variance(self.covariance, 1.0))

    def measured(self, directions: np.ndarray, noise: float) -> np.ndarray:
        """Covariance after K linear combinations (K, D) of the unknowns were measured (Kalman).

        Args:
            noise: Variance of each measurement.
        """
        explained = self.covariance @ directions.T
        innovation = directions @ explained + noise * np.eye(len(directions))
        return self.covariance - explained @ np.linalg.solve(innovation, explained.T)

    def launched(self, aim: int, tape: float, count: int = 1) -> np.ndarray:
        """Covariance after `count` launches at one of the targets were measured to `tape` [m]."""
        return self.measured(self.gradient[[aim]], (self.draw[aim] ** 2 + tape**2) / count)

    def known(self, *names: str, spread: float = 0.0) -> np.ndarray:
        """Covariance after unknowns were measured to a standard deviation."""
        which = [self.names.index(name) for name in names if name in self.names]
        return self.measured(np.eye(len(self.names))[which], spread**2)


def unknowns(names: Sequence[str], samples: np.ndarray) -> dict[str, np.ndarray]:
    """Columns (M,) of samples (M, P) that vary, as they are Gaussian."""
    columns, rows = {}, {row.name: row for row in TABLE if isinstance(row, Parameter)}
    for name, column in zip(names, samples.T, strict=True):
        coordinate = rows[name].coordinate
        column = np.log(column) if coordinate and coordinate.log else column
        if len(column) and np.ptp(column) > LEAST_RANGE:
            columns[name] = column
    return columns
