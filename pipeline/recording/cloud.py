"""Masked depth to clouds: outliers off first, because farthest point sampling would pick them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.errors import UserError
from pipeline.recording.mask import masker
from pipeline.recording.view import View

MOST_EMPTY = 0.5  # share of frames without any band


@dataclass(frozen=True)
class Clouds:
    """Points of the band, each cloud at its own camera stamp.

    Attributes:
        time: Stamps, seconds since the window's start, shape (K,).
        points: Frame O, K arrays of shape (<= points, 3), float32; some may be empty.
        pixels: Masked pixels of each frame before outliers were removed, shape (K,).
        color_counts: Whether the band's colour told it from the arm's.
        damaged: Frames of the window that could not be decoded.
        unpaired: Depth frames of the window without a colour frame.
    """

    time: np.ndarray
    points: list[np.ndarray]
    pixels: np.ndarray
    color_counts: bool
    damaged: int
    unpaired: int

    @property
    def empty(self) -> int:
        return sum(not len(points) for points in self.points)


def clouds_of(view: View, cloud: object) -> Clouds:
    """Mask and sample every frame. `cloud` is that section of params.

    Raises:
        UserError: if the band is seen in too few frames.
    """
    path = view.recording.path
    if not len(view):
        raise UserError(f"{path}: no camera frames between the window's start and end")
    mask = masker(cloud.mask, view)
    times, points, pixels = [], [], []
    for _, frame in view.frames():
        found = mask.mask(frame)
        times.append(frame.time)
        pixels.append(int(found.sum()))
        points.append(sample(frame.points[found], cloud))
    clouds = Clouds(
        np.array(times),
        points,
        np.array(pixels),
        getattr(mask, "likeness", None) is not None,
        len(view.damaged),
        view.unpaired,
    )
    if clouds.empty > MOST_EMPTY * len(times):
        raise UserError(
            f"{path}: empty mask, the band is not found in {clouds.empty} of {len(times)} frames:"
            " check the camera's extrinsics and the band's diameter and rest_length"
        )
    return clouds


def sample(points: np.ndarray, cloud: object) -> np.ndarray:
    """Statistical and radius outlier removal, then at most cloud.points of them, (P, 3) float32."""
    import open3d

    if len(points) <= cloud.statistical_neighbors:
        return np.zeros((0, 3), np.float32)
    dense = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points.astype(np.float64)))
    dense, _ = dense.remove_statistical_outlier(
        cloud.statistical_neighbors, cloud.statistical_ratio
    )
    dense, _ = dense.remove_radius_outlier(cloud.radius_neighbors, cloud.radius)
    if len(dense.points) > cloud.points:
        dense = dense.farthest_point_down_sample(cloud.points)
    return np.asarray(dense.points, np.float32).reshape(-1, 3)
