"""Promising regions of a search: lines 3 and 4 of the paper's algorithm 1.

Centres by non-maximum suppression (NMS), covariances of the evaluated neighbours.

Distances are those of the unit cube; failed rows count for nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import model_validator

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.base.schema import JsonRecord, Name, read_json, refusal
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.settings.identification import MethodParams, OptimizerParams

COVARIANCE_RIDGE = 1e-3  # of the mean variance, added to every variance
LEAST_VARIANCE = 1e-6  # a thousandth of the box, where all neighbours are one point


@dataclass(frozen=True)
class Region:
    """Where one local search starts.

    Attributes:
        mu: Centre in the unit cube, shape (D,).
        sigma: Positive definite covariance, shape (D, D).
        loss: Of the centre.
        members: Evaluated rows that the covariance is of, nearest first; the centre is one.
    """

    mu: np.ndarray
    sigma: np.ndarray
    loss: float
    members: list[int]


def regions_of(
    method_params: MethodParams, optimizer: OptimizerParams, evaluations: Evaluations
) -> list[Region]:
    """Where a method's refinement begins.

    Args:
        method_params: params.yaml's `methods.<name>`.
        optimizer: params.yaml's `optimizer`.
        evaluations: Of its exploration, on its free axes.

    Raises:
        UserError: As `find_regions`.
    """
    return find_regions(
        evaluations.unit,
        evaluations.total,
        k_top=method_params.k_top or optimizer.k_top,
        k_nn=optimizer.k_nn,
        delta=optimizer.delta,
        covariance=method_params.covariance,
    )


def find_regions(
    unit: np.ndarray,
    total: np.ndarray,
    *,
    k_top: int,
    k_nn: int,
    delta: float,
    covariance: bool = True,
) -> list[Region]:
    """The k_top best regions of evaluated points (N, D) with losses (N,); fewer if there are fewer.

    Without `covariance` each Sigma is a multiple of the identity, of the same determinant.

    Raises UserError if not even two points have a finite loss.
    """
    good = np.flatnonzero(np.isfinite(total))
    if len(good) < 2:
        raise UserError(
            f"only {len(good)} of {len(total)} simulations succeeded: no region to refine;"
            " check the recording, and the box under `parameters` in params.yaml"
        )
    regions = []
    for centre in good[suppress(unit[good], total[good], delta, k_top)]:
        distance = np.linalg.norm(unit[good] - unit[centre], axis=1)
        members = good[np.argsort(distance, kind="stable")[:k_nn]]
        sigma = regularised(np.cov(unit[members], rowvar=False))
        sigma = sigma if covariance else isotropic(sigma)
        regions.append(Region(unit[centre], sigma, float(total[centre]), members.tolist()))
    return regions


def suppress(unit: np.ndarray, total: np.ndarray, radius: float, count: int) -> list[int]:
    """Rows, best first, that lie further than `radius` from every better row that was kept."""
    chosen: list[int] = []
    for row in np.argsort(total, kind="stable"):
        if all(np.linalg.norm(unit[row] - unit[other]) > radius for other in chosen):
            chosen.append(int(row))
        if len(chosen) == count:
            break
    return chosen


def regularised(covariance: np.ndarray) -> np.ndarray:
    """Covariance (D, D) with a ridge, so that its Cholesky factor exists."""
    covariance = np.atleast_2d(covariance)
    dimension = len(covariance)
    ridge = max(COVARIANCE_RIDGE * np.trace(covariance) / dimension, LEAST_VARIANCE)
    return covariance + ridge * np.eye(dimension)


def isotropic(covariance: np.ndarray) -> np.ndarray:
    """The ball whose volume is that of the ellipsoid of a positive definite covariance (D, D)."""
    dimension = len(covariance)
    _, log_determinant = np.linalg.slogdet(covariance)
    return np.exp(log_determinant / dimension) * np.eye(dimension)


class RegionEntry(JsonRecord):
    """A region; mu and Sigma are in the unit cube."""

    mu: list[float]
    Sigma: list[list[float]]
    loss: float
    members: list[int]


class RegionsFile(JsonRecord):
    names: list[Name]
    clusters: list[RegionEntry]

    @model_validator(mode="after")
    def _a_number_for_each_name(self) -> RegionsFile:
        count = len(self.names)
        for cluster in self.clusters:
            if [len(cluster.mu), *map(len, cluster.Sigma)] != [count] * (1 + count):
                raise refusal(f"clusters: mu must have {count} numbers, Sigma {count} rows of them")
        return self


def save_regions(path: Path, names: tuple[str, ...], regions: list[Region]) -> None:
    """Write a `RegionsFile` with its axes' `names`."""
    clusters = [
        {"mu": region.mu.tolist(), "Sigma": region.sigma.tolist(), "loss": region.loss}
        | {"members": region.members}
        for region in regions
    ]
    write_json(path, {"names": list(names), "clusters": clusters})


def load_regions(path: Path) -> tuple[list[Region], list[str]]:
    """The regions of such a file, and the names of their axes. Raises NotMade."""
    read = read_json(path, RegionsFile)
    regions = [
        Region(np.array(cluster.mu), np.array(cluster.Sigma), cluster.loss, cluster.members)
        for cluster in read.clusters
    ]
    return regions, read.names
