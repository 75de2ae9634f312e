"""The Chamfer distance as the paper prints it: between two point clouds, of which one is simulated.

For clouds A and B it is (mean over A of the distance to the nearest of B + the same back) / 2. The
simulated cloud is that of a mesh: vertices all around the tube, on the side that no camera sees
too. It is computed on the CPU, wherever the rollouts are.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

RINGS, AROUND = 125, 8  # vertices along the band and around it: as many as a measured cloud has


class CloudDistance:
    """Frame by frame distances of one episode's clouds to those of simulated bands."""

    def __init__(
        self,
        clouds: list[np.ndarray],
        camera: np.ndarray,
        *,
        radius: float,
        rest_length: float | np.ndarray,
    ) -> None:
        """Keep a tree of each cloud; arguments as of `Chamfer`."""
        self.clouds, self.frames = clouds, len(clouds)
        self.camera, self.radius = np.asarray(camera, float), float(radius)
        self.rest_length = np.asarray(rest_length, float)
        self._trees = [cKDTree(cloud) if len(cloud) else None for cloud in clouds]

    def __call__(self, center_line: np.ndarray, device: str = "cpu") -> np.ndarray:
        """Distances [m], shape (N, K), of centre lines [m], (N, K, L, 3).

        NaN where a frame shows nothing, or a rollout is not finite.

        Args:
            center_line: NumPy's, or Warp's on any device, which `device` names in vain.
        """
        if not isinstance(center_line, np.ndarray):
            center_line = center_line.numpy()
        distances = np.full(center_line.shape[:2], np.nan)
        for lines, row in zip(center_line, distances, strict=True):
            for k, (line, cloud, tree) in enumerate(
                zip(lines, self.clouds, self._trees, strict=True)
            ):
                if tree is not None and np.isfinite(line).all():
                    row[k] = self._distance(self.vertices(line), cloud, tree)
        return distances

    def vertices(self, line: np.ndarray) -> np.ndarray:
        """The simulated cloud of one centre line (L, 3): RINGS x AROUND vertices, (V, 3) [m].

        Rings are evenly spaced along the unstretched band, and as thin as an incompressible band is
        where it is stretched.
        """
        line = np.asarray(line, float)
        edge, rest = np.diff(line, axis=0), self._rest(len(line) - 1)
        length = np.linalg.norm(edge, axis=1)
        arc = np.concatenate([[0.0], np.cumsum(rest)])
        at = (np.arange(RINGS) + 0.5) / RINGS * arc[-1]
        on = np.searchsorted(arc, at, side="right") - 1
        centre = line[on] + ((at - arc[on]) / rest[on])[:, None] * edge[on]
        along = edge[on] / np.maximum(length[on], 1e-12)[:, None]
        view = self.camera - centre  # one vertex of each ring faces the camera
        first = view - (view * along).sum(axis=1, keepdims=True) * along
        first /= np.linalg.norm(first, axis=1, keepdims=True) + 1e-12
        second = np.cross(along, first)
        radius = self.radius * np.sqrt(rest / np.maximum(length, rest / 4))[on]  # as in chamfer.h
        angle = 2 * np.pi * np.arange(AROUND) / AROUND
        around = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
        return (centre[:, None] + radius[:, None, None] * around).reshape(-1, 3)

    def _rest(self, edges: int) -> np.ndarray:
        one = self.rest_length
        return one if one.ndim else np.full(edges, one / edges)

    @staticmethod
    def _distance(vertices: np.ndarray, cloud: np.ndarray, tree: cKDTree) -> float:
        simulated = cKDTree(vertices, compact_nodes=False, balanced_tree=False)
        there, back = simulated.query(cloud)[0].mean(), tree.query(vertices)[0].mean()
        return float(there + back) / 2
