"""Masked depth to clouds: outliers off first, because farthest point sampling would pick them.

`cloud.sampling: before_filters` samples first, in the paper's order.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores
from sling2sim2real.recording.blind import why_no_band
from sling2sim2real.recording.masks import masker
from sling2sim2real.recording.view import RgbdFrame, View
from sling2sim2real.settings.recording import CloudParams

ALONE = 0.2  # share of the points a band has within a radius: what has fewer is no band
MOST_EMPTY = 0.5  # share of frames without any band


@dataclass(frozen=True)
class Clouds:
    """Points of the band, each cloud at its own camera stamp.

    Attributes:
        time: Stamps, seconds since the window's start, shape (K,).
        points: Frame O, K arrays of shape (<= points, 3), float32; some may be empty.
        pixels: Masked pixels of each frame before outliers were removed, shape (K,).
        color_counts: Whether the band's colour differs from the arm's.
        damaged, damaged_colors: Frames of the window that could not be decoded, and those of them
            whose depth could.
        unpaired: Depth frames of the window without a colour frame.
    """

    time: np.ndarray
    points: list[np.ndarray]
    pixels: np.ndarray
    color_counts: bool
    damaged: int
    unpaired: int
    damaged_colors: int = 0

    @property
    def empty(self) -> int:
        return sum(not len(points) for points in self.points)


def clouds_of(view: View, cloud: CloudParams) -> Clouds:
    """Mask and sample every frame, several at once.

    Raises:
        UserError: if the band is seen in too few frames.
    """
    path = view.recording.path
    if not len(view):
        raise UserError(f"{path}: no camera frames between the window's start and end")
    mask = masker(cloud.mask, view)

    def of_frame(number: int) -> list[tuple[float, np.ndarray, int]]:
        """Nothing of a damaged frame."""
        return [
            (frame.time, cloud_of(view, frame, of_band, cloud), int(of_band.sum()))
            for _, frame in view.frames([number])
            for of_band in [mask.mask(frame)]
        ]

    with ThreadPoolExecutor(cores()) as pool:
        rows = [row for rows in pool.map(of_frame, range(len(view))) for row in rows]
    times, points, pixels = zip(*rows, strict=True) if rows else ((), (), ())
    clouds = Clouds(
        np.array(times),
        list(points),
        np.array(pixels),
        getattr(mask, "colors", None) is not None,
        len(view.damaged),
        view.unpaired,
        sum(role == "color" for role in view.damaged.values()),
    )
    if not times:
        raise view.undecoded(view.damaged[0])
    if clouds.empty > MOST_EMPTY * len(times):
        cure = "the masks" if cloud.mask == "folder" else "the band's diameter and rest_length"
        why = why_no_band(view) or f"check the camera's extrinsics and {cure}"
        raise UserError(
            f"{path}: empty mask, the band is not found in {clouds.empty} of {len(times)} frames:"
            f" {why}"
        )
    return clouds


def cloud_of(view: View, frame: RgbdFrame, mask: np.ndarray, cloud: CloudParams) -> np.ndarray:
    """Points of the pixels `found` (H, W), without outliers and sampled, (P, 3) float32."""
    if not mask.any():
        return np.zeros((0, 3), np.float32)
    matrix = view.recording.depth_camera.matrix
    per_square = matrix[0, 0] * matrix[1, 1] / float(np.median(frame.depth[mask])) ** 2
    return sample(frame.points[mask], cloud, view.scene.diameter * per_square)


def sample(points: np.ndarray, cloud: CloudParams, density: float = np.inf) -> np.ndarray:
    """Statistical and radius outlier removal, and at most cloud.points of them, (P, 3) float32.

    Which of both comes first, cloud.sampling says.

    Args:
        points: Shape (S, 3).
        density: Points that a metre of the band may have; of a thin or far band no more neighbours
            are asked for than it can have.
    """
    import open3d

    expected = ALONE * density * 2 * cloud.radius
    neighbors = int(np.clip(expected, 1, cloud.radius_neighbors))

    if len(points) <= cloud.statistical_neighbors:
        return np.zeros((0, 3), np.float32)

    def sampled(dense):
        more = len(dense.points) > cloud.points
        return dense.farthest_point_down_sample(cloud.points) if more else dense

    dense = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(np.float64)))
    if cloud.sampling == "before_filters":
        dense = sampled(dense)
    dense, _ = dense.remove_statistical_outlier(
        cloud.statistical_neighbors, cloud.statistical_ratio
    )
    dense, _ = dense.remove_radius_outlier(neighbors, cloud.radius)
    return np.asarray(sampled(dense).points, np.float32).reshape(-1, 3)
