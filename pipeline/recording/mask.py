"""Which pixels show the band: backends behind one seam.

A backend is made for one view, learns once from a part of its frames, and then masks each frame.
"""

from __future__ import annotations

from typing import Protocol

import cv2
import numpy as np

from pipeline.errors import UserError
from pipeline.recording.view import Frame, Scene, View

LEARNING_FRAMES = 80
BINS = 16  # of each Lab axis
THICKNESS = 1.9  # diameters: what is wider in the picture is no band
RIDGE = 0.5  # diameters by which the band stands out from what is around it
TAUT = 1.05  # stretch from which the held band is two straight lines
HAND = 0.025  # m around the tool centre point that the fingers take
PALM = (0.30, 0.12)  # m: length and radius of what follows behind the fingers


class Masker(Protocol):
    def mask(self, frame: Frame) -> np.ndarray:
        """Pixels of the band, shape (H, W), bool."""


def masker(name: str, view: View) -> Masker:
    """The backend of params.cloud.mask. Raises UserError for one that is not there."""
    if name == "opencv":
        return RidgeMask(view)
    raise UserError(f"cloud.mask: backend {name!r} is not available, use opencv")


class RidgeMask:
    """The band as a thin ridge of the depth, of its own colour, that is not always there.

    Nothing is known of the band's colour beforehand. While the hand holds it taut, it lies on the
    lines from the tips to the hand: the colours seen there are the band's, the other moving
    colours are the arm's. Elsewhere a pixel is the band's if it
    - lies where a band of that length can be, above the floor (which rejects shadows),
    - stands out from its surroundings and is as thin as the band (which rejects the arm),
    - is nearer than what is always seen there (which rejects the fork),
    - is not in the hand, and has a colour of the band rather than of the arm.
    """

    def __init__(self, view: View):
        self.scene = view.scene
        self.focal = float(view.recording.depth_camera.matrix[0, 0])
        self.noise = 0.0
        learning = [f for _, f in view.frames(every=max(1, len(view) // LEARNING_FRAMES))]
        if not learning:
            raise UserError(f"{view.recording.path}: no camera frame in the window can be decoded")
        self.background = _background(np.stack([frame.depth for frame in learning]))
        self.likeness = _likeness(*self._samples(learning))

    def mask(self, frame: Frame) -> np.ndarray:
        found = self._candidates(frame)
        if self.likeness is not None:
            found &= self.likeness[_bins(frame.color)] > 0.5
        return _large_enough(found, self._pixels(frame)[found])

    def _candidates(self, frame: Frame) -> np.ndarray:
        """Thin, new and near pixels outside the hand."""
        found = frame.near & self._thin(frame)
        found &= frame.depth < self.background - RIDGE * self.scene.diameter
        return found & ~_in_hand(frame.points, self.scene, frame.time)

    def _pixels(self, frame: Frame) -> np.ndarray:
        """Diameter of a band in pixels at each pixel's depth."""
        return self.focal * self.scene.diameter / np.maximum(frame.depth, 0.05)

    def _thin(self, frame: Frame) -> np.ndarray:
        """Pixels nearer than a closing of the depth, which fills whatever is narrower than it."""
        far = np.where(frame.depth > 0, frame.depth, 1e2).astype(np.float32)
        width = THICKNESS * self._pixels(frame)
        sizes = 2 * np.round(width / 2).astype(int) + 1
        thin = np.zeros(far.shape, bool)
        for size in np.unique(sizes[frame.near]):
            kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (int(size), int(size)))
            filled = cv2.morphologyEx(far, cv2.MORPH_CLOSE, kernel)
            thin |= (sizes == size) & (filled - far > RIDGE * self.scene.diameter)
        return thin

    def _samples(self, frames: list[Frame]) -> tuple[np.ndarray, np.ndarray]:
        """Lab bins of pixels that are surely the band's, and of others that move."""
        band, other = [], []
        for frame in frames:
            if not self.scene.holds(frame.time) or self.scene.stretch(frame.time) < TAUT:
                continue
            bins = _bins(frame.color)
            off = _off_lines(frame.points, self.scene, frame.time)
            moving = frame.near & (frame.depth < self.background - 2 * self.scene.diameter)
            sure = self._candidates(frame) & (off < 1.5 * self.scene.diameter)
            rest = moving & (off > 3 * self.scene.diameter)
            band.append(np.stack([axis[sure] for axis in bins]))
            other.append(np.stack([axis[rest] for axis in bins]))
        empty = np.zeros((3, 0), int)
        return np.hstack(band or [empty]), np.hstack(other or [empty])


def _background(depths: np.ndarray) -> np.ndarray:
    """What is seen at each pixel behind all that moves: a high percentile over time, (H, W)."""
    known = np.where(depths > 0, depths, 0)
    ordered = np.sort(known, axis=0)
    background = ordered[int(0.9 * (len(ordered) - 1))]
    return np.where(background > 0, background, np.inf)


def _bins(color: np.ndarray) -> tuple[np.ndarray, ...]:
    lab = cv2.cvtColor(color, cv2.COLOR_BGR2LAB)
    return tuple(np.moveaxis(lab // (256 // BINS), -1, 0).astype(np.intp))


def _likeness(band: np.ndarray, other: np.ndarray) -> np.ndarray | None:
    """Share of the band in each colour bin, (B, B, B); None where colours do not tell it apart."""
    if band.shape[1] < 200 or other.shape[1] < 200:
        return None
    counts = []
    for samples in (band, other):
        histogram = np.zeros((BINS,) * 3, np.float64)
        np.add.at(histogram, tuple(samples), 1.0)
        for axis in range(3):  # neighbours are alike
            padded = np.pad(histogram, [(1, 1) if a == axis else (0, 0) for a in range(3)], "edge")
            parts = [np.take(padded, np.arange(BINS) + shift, axis) for shift in range(3)]
            histogram = 0.25 * parts[0] + 0.5 * parts[1] + 0.25 * parts[2]
        counts.append(histogram / histogram.sum() + 1e-6)
    share = counts[0] / (counts[0] + counts[1])
    right = (share[tuple(band)] > 0.5).mean() + (share[tuple(other)] <= 0.5).mean()
    return share if right / 2 > 0.8 else None


def _off_lines(points: np.ndarray, scene: Scene, time: float) -> np.ndarray:
    """Distance of points from the lines tip to hand, without their ends; inf beyond the ends."""
    hand = scene.signals.hand(time)
    distances = []
    for tip in scene.tips:
        way = hand - tip
        length = np.linalg.norm(way)
        along = (points - tip) @ (way / length)
        off = np.linalg.norm(points - tip - along[..., None] * (way / length), axis=-1)
        inside = (along > 0.1 * length) & (along < 0.85 * length)
        distances.append(np.where(inside, off, np.where(off < 0.05, 0.02, np.inf)))
    return np.minimum(*distances)


def _in_hand(points: np.ndarray, scene: Scene, time: float) -> np.ndarray:
    """Around the tool centre point, and behind it along the tool's axis."""
    away = points - scene.signals.hand(time)
    behind = -(away @ scene.signals.tool_axis)
    radius = np.sqrt(np.maximum((away**2).sum(axis=-1) - behind**2, 0))
    palm = (behind > HAND) & (behind < PALM[0]) & (radius < PALM[1])
    return palm | ((away**2).sum(axis=-1) < HAND**2)


def _large_enough(found: np.ndarray, diameters: np.ndarray) -> np.ndarray:
    """Without specks: parts smaller than a piece of band as long as it is thick."""
    if not found.any():
        return found
    least = float(np.median(diameters)) ** 2
    count, labels, stats, _ = cv2.connectedComponentsWithStats(found.astype(np.uint8), None, None, None, 8)
    keep = stats[:, cv2.CC_STAT_AREA] >= least
    keep[0] = False
    return keep[labels]
