"""Distance between measured point clouds and simulated bands, for a batch of rollouts.

It is the mean of both directions' mean distances. The simulated band is

    tube  around its centre line, a piece an edge. Measured to simulated: each point's distance to
          the surface of the nearest piece. Simulated to measured: for points on the ridge of the
          tube that faces the camera, the distance to the nearest measured point; what the camera
          cannot see counts for nothing.
    mesh  as the paper prints it, between two clouds: vertices all around the tube, in rings that
          are evenly spaced along the unstretched band, on the side that no camera sees too. Each
          point's distance is that to the nearest point of the other cloud.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import warp as wp

LANES = {"cpu": 16, "cuda": 32}


class Chamfer:
    """Frame by frame distances of one episode's clouds to simulated centre lines."""

    def __init__(
        self,
        clouds: list[np.ndarray],
        camera: np.ndarray,
        *,
        radius: float,
        rest_edges: np.ndarray,
        surface: str = "tube",
        culled: bool = True,
    ) -> None:
        """Keep the clouds, and from their first use on a device a copy there.

        Args:
            clouds: Points of each frame [m], K arrays of shape (P, 3); an empty one counts as NaN.
            camera: Its position [m], shape (3,).
            radius, rest_edges: Of the unstretched band, and of its edges, shape (L - 1,) [m]. It
                thins where it is stretched, as an incompressible body does.
            surface: "tube" or "mesh".
            culled: Skip what cannot be nearest; without, the same bits come later.
        """
        self.camera = np.asarray(camera, float)
        self.radius, self.rest_edges = float(radius), np.asarray(rest_edges, np.float32)
        self.surface, self.culled, self.clouds = surface, culled, clouds
        self._packed: dict[str, list[wp.array]] = {}
        self._lock = threading.Lock()

    def __call__(self, center_line: np.ndarray | wp.array, device: str = "cpu") -> np.ndarray:
        """Distances [m], shape (N, K), of centre lines [m], (N, K, L, 3), computed on `device`.

        A frame's distance depends on no other frame or rollout, and so not on who shares its batch.

        Args:
            center_line: NumPy's, or Warp's on that device.
        """
        count, frames = center_line.shape[:2]
        both = self.errors(center_line, device).numpy().reshape(count, frames, 2).astype(float)
        return both.mean(axis=2)

    def errors(self, center_line: np.ndarray | wp.array, device: str) -> wp.array:
        """Distances in both directions [m], as Warp's float32 (N * K * 2,) on that device."""
        import warp as wp

        from sling2sim2real.base.native import empty, run_kernel
        from sling2sim2real.identification.objective.kernels import chamfer_kernel

        count, frames, nodes, _ = center_line.shape
        if frames != len(self.clouds):
            raise ValueError(f"{frames} simulated frames, {len(self.clouds)} measured")
        lanes = LANES["cuda" if device.startswith("cuda") else "cpu"]
        kernel, kind = chamfer_kernel(self.surface, nodes - 1, lanes, self.culled)
        with self._lock:
            if device not in self._packed:
                shared = *_pack(self.clouds, lanes), self.rest_edges
                self._packed[device] = [wp.array(array, device=device) for array in shared]
        arrays = kind()
        arrays.points, arrays.balls, arrays.frame_blocks, arrays.frame_groups, arrays.rest_edges = (
            self._packed[device]
        )
        if isinstance(center_line, np.ndarray):
            center_line = wp.array(np.ascontiguousarray(center_line, np.float32), device=device)
        arrays.line, arrays.frames = center_line.flatten(), frames
        arrays.radius, arrays.camera = self.radius, wp.vec3(*self.camera)
        arrays.errors = errors = empty(count * frames * 2, wp.float32, device)
        run_kernel(kernel, count * frames, [arrays], device)
        return errors


def _pack(clouds: list[np.ndarray], lanes: int) -> tuple[np.ndarray, ...]:
    """Points in compact blocks, and balls around these, as chamfer.h wants them.

    Returns:
        Blocks of `lanes` points as rows x, y, z, weight; groups of `lanes` balls as rows x, y, z,
        radius; where each frame's blocks and where its groups begin.
    """
    blocks, balls, first = [np.zeros(0, np.float32)], [np.zeros(0, np.float32)], [(0, 0)]
    for cloud in clouds:
        size = -(-len(cloud) // lanes)
        groups = -(-size // lanes)
        rows = np.zeros((size * lanes, 4), np.float32)
        rows[: len(cloud), :3] = _compact(cloud.astype(np.float32), lanes)
        rows[: len(cloud), 3] = 1
        rows[len(cloud) :, :3] = rows[len(cloud) - 1 : len(cloud), :3]  # weighs 0, is no nearer
        rows = rows.reshape(size, lanes, 4)
        blocks.append(_by_rows(rows, size, lanes))
        balls.append(_by_rows(_balls(rows[:, :, :3], groups * lanes), groups, lanes))
        first.append((size, groups))
    first = np.cumsum(first, axis=0, dtype=np.int32)
    return np.concatenate(blocks), np.concatenate(balls), first[:, 0].copy(), first[:, 1].copy()


def _by_rows(entries: np.ndarray, count: int, lanes: int) -> np.ndarray:
    return entries.reshape(count, lanes, 4).transpose(0, 2, 1).ravel()


def _compact(cloud: np.ndarray, size: int) -> np.ndarray:
    """The points in another order, `size` after each other near together: halved where widest."""
    if len(cloud) <= size:
        return cloud
    axis = (cloud.max(axis=0) - cloud.min(axis=0)).argmax()
    cloud = cloud[cloud[:, axis].argsort(kind="stable")]  # the same order on every CPU
    half = -(-len(cloud) // size) // 2 * size
    return np.concatenate([_compact(cloud[:half], size), _compact(cloud[half:], size)])


def _balls(blocks: np.ndarray, count: int) -> np.ndarray:
    """Centres and radii of balls around blocks (B, lanes, 3), shape (count, 4); others far off."""
    balls = np.zeros((count, 4), np.float32)
    balls[len(blocks) :, :3] = 1e18
    centre = ((blocks.max(axis=1) + blocks.min(axis=1)) / 2).astype(np.float32)
    away = np.linalg.norm(blocks.astype(float) - centre[:, None], axis=2).max(axis=1)
    balls[: len(blocks), :3], balls[: len(blocks), 3] = centre, 1.00001 * away
    return balls
