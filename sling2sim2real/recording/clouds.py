"""Masked depth to clouds, and how well they cover the band, picture by picture."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores
from sling2sim2real.recording.mask import HAND, RidgeMask, distance_to_lines
from sling2sim2real.recording.mask_folder import FolderMask
from sling2sim2real.recording.scene import RgbdFrame, Scene, View, why_no_band
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


def masker(name: str, view: View) -> RidgeMask | FolderMask:
    """The backend of params.cloud.mask. Raises UserError where its masks are missing."""
    return {"opencv": RidgeMask, "folder": FolderMask}[name](view)


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
    expected = ALONE * density * 2 * cloud.radius
    neighbors = int(np.clip(expected, 1, cloud.radius_neighbors))
    if len(points) <= cloud.statistical_neighbors:
        return np.zeros((0, 3), np.float32)
    points = points.astype(np.float64)
    if cloud.sampling == "before_filters":
        points = _spread(points, cloud.points)
    nearest = np.arange(1, min(cloud.statistical_neighbors, len(points)) + 1)
    mean = cKDTree(points).query(points, nearest)[0].mean(axis=1)
    points = points[mean < mean.mean() + cloud.statistical_ratio * mean.std(ddof=1)]
    near = cKDTree(points).query_ball_point(points, cloud.radius, return_length=True)
    return _spread(points[near > neighbors], cloud.points).astype(np.float32)


def _spread(points: np.ndarray, most: int) -> np.ndarray:
    """At most so many of some points (S, 3), by farthest point sampling."""
    if len(points) <= most:
        return points
    import open3d  # takes 0.2 GB

    dense = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    return np.asarray(dense.farthest_point_down_sample(most).points)


COVERED = 1.5  # diameters from a point of the cloud to the part of the band that it stands for
FINGERS = 0.05  # m of a slack band that the open or closed hand may hide
RECOIL = 0.15  # s after the release
# From the plane in which a slack band hangs [m]: six sound recordings have no point beyond 16 mm,
# and a hand's or an arm's points lie 3 cm off and more.
OFF_PLANE = 0.02
LIFTED = 0.5  # of the way to the tips' height, from which the slack band may swing
PHASES = ("hanging", "held", "drawn", "recoil", "swing")


@dataclass(frozen=True)
class PictureLine:
    """How well one picture shows the band; `time` is since the file's first force [s].

    Attributes:
        points: Of the cloud.
        coverage: As of `share_covered`.
        off_plane: As of `share_off_plane`.
    """

    time: float
    phase: str
    points: int
    coverage: float
    off_plane: float | None


def taut_coverage(scene: Scene, clouds: Clouds) -> tuple[float | None, float | None]:
    """How well the clouds see the drawn band, whose place is known: two lines, tip to hand.

    Returns:
        Share of the lines (without the fingers' part) that has points beside it, and the median
        distance of points from the lines [m], which is the band's radius where the calibration is
        right; None where the band was never taut.
    """
    taut = [
        (time, points)
        for time, points in zip(clouds.time, clouds.points, strict=True)
        if scene.taut(time) and len(points)
    ]
    if not taut:
        return None, None
    shares = [share_covered(scene, time, points) for time, points in taut]
    offsets = [distance_to_lines(points, scene, time) for time, points in taut]
    return float(np.mean(shares)), float(np.median(np.concatenate(offsets)))


def share_covered(scene: Scene, time: float, points: np.ndarray) -> float:
    """Share of the band that has points beside it.

    Where it is drawn: of the two straight lines. Where it is slack its place is not known, but it
    runs from tip to tip: of the places x between the tips, less what the hand hides.
    """
    if not len(points):
        return 0.0
    if scene.taut(time):
        near, shares = cKDTree(points), []
        for tip in scene.tips:
            way = scene.signals.hand(time) - tip
            length = np.linalg.norm(way)
            parts = np.arange(0.0, length - HAND, scene.diameter)[:, None] / length
            shares.append(near.query(tip + parts * way)[0] < COVERED * scene.diameter)
        return float(np.mean(np.concatenate(shares)))
    places = np.arange(scene.tips[0, 0] + scene.diameter, scene.tips[1, 0], scene.diameter)
    if scene.holds(time):
        places = places[np.abs(places - scene.signals.hand(time)[0]) > FINGERS]
    gaps = np.abs(places[:, None] - points[:, 0]).min(axis=1)
    return float(np.mean(gaps < COVERED * scene.diameter))


def share_off_plane(scene: Scene, time: float, points: np.ndarray) -> float | None:
    """Share of points that lie off the plane through the tips and the hand that holds the band.

    Before the grasp it is the upright plane through the tips. None where the band need not lie in
    such a plane: drawn, swinging, or lifted.
    """
    if not len(points) or time >= scene.signals.release_time:
        return None
    down = np.array([0.0, -1.0])  # y, z
    if scene.holds(time):
        down = scene.signals.hand(time)[1:]
        if down[1] > LIFTED * scene.signals.hand(scene.signals.grasp_time)[2]:
            return None
    across = np.array([down[1], -down[0]]) / np.linalg.norm(down)
    return float(np.mean(np.abs(points[:, 1:] @ across) > OFF_PLANE))


def phase(scene: Scene, time: float) -> str:
    """One of PHASES."""
    signals = scene.signals
    if time < signals.grasp_time:
        return "hanging"
    if time < signals.release_time:
        return "drawn" if scene.taut(time) else "held"
    return "recoil" if time < signals.release_time + RECOIL else "swing"


def over_time(scene: Scene, clouds: Clouds, start: float) -> list[PictureLine]:
    """A row a picture; times count from `start` seconds before the window."""
    return [
        PictureLine(
            time=round(start + float(time), 6),
            phase=phase(scene, time),
            points=len(points),
            coverage=round(share_covered(scene, time, points), 4),
            off_plane=share_off_plane(scene, time, points),
        )
        for time, points in zip(clouds.time, clouds.points, strict=True)
    ]


def by_phase(rows: Sequence[PictureLine]) -> list[dict[str, Any]]:
    """The rows of `over_time` gathered; `empty` are those without a point, `points` the median."""
    parts = {name: [row for row in rows if row.phase == name] for name in PHASES}
    return [
        {
            "phase": name,
            "start": part[0].time,
            "end": part[-1].time,
            "pictures": len(part),
            "empty": sum(not row.points for row in part),
            "points": int(np.median([row.points for row in part])),
            "coverage": round(float(np.mean([row.coverage for row in part])), 4),
        }
        for name, part in parts.items()
        if part
    ]
