"""Iterative closest points (ICP), from points to planes, of a body that is moved and not turned."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

FEWEST = 100  # points of a body that is seen
NEIGHBOURS = 12  # by which the normal at a point is told
FLAT = 0.1  # of the variances of neighbours across and along a surface
NEAREST = (
    0.02,
    0.01,
    0.004,
    0.004,
    0.004,
)  # m between points that are laid on each other, by round


class Surface:
    """Points of a rigid body with their normals, on which others are laid.

    Args:
        points: Shape (P, 3) [m].
        most: Of them that are kept.
    """

    def __init__(self, points: np.ndarray, most: int):
        self.tree: cKDTree | None = None
        if len(points) < FEWEST:
            return
        points = np.random.default_rng(0).permutation(points)[:most]
        _, index = cKDTree(points).query(points, k=NEIGHBOURS)
        around = points[index] - points[index].mean(axis=1, keepdims=True)
        spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
        flat = spread[:, 0] < FLAT * spread[:, 1]
        self.points, self.normals = points[flat], axes[flat, :, 0]
        if len(self.points) >= FEWEST:
            self.tree = cKDTree(self.points)

    def lay(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """Displacement of points (P, 3), and the root of its information, (3,) and (3, 3).

        Both are per point; the information is small where a surface could slide along itself. None
        where too little of the surface is seen.
        """
        if self.tree is None:
            return None
        offset, sure = np.zeros(3), np.zeros((3, 3))
        for most in NEAREST:
            distance, index = self.tree.query(points - offset, distance_upper_bound=most)
            near = np.isfinite(distance)
            if near.sum() < FEWEST:
                return None
            normals = self.normals[index[near]]
            across = points[near] - offset - self.points[index[near]]
            sure = normals.T @ normals / len(normals)
            gap = np.einsum("ij,ij->i", normals, across)
            offset = offset + np.linalg.lstsq(sure, normals.T @ gap / len(gap), rcond=0.02)[0]
        return offset, np.linalg.cholesky(sure + 1e-6 * np.eye(3)).T
