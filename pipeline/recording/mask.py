"""Which pixels show the band: backends behind one seam.

A backend is made for one view, learns once from a part of its frames, and then masks each frame.
"""

from __future__ import annotations

from typing import Protocol

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from pipeline.errors import UserError
from pipeline.recording.view import Frame, Scene, View, length

LEARNING_FRAMES = 80
BACKGROUND = 0.8  # share of the time that the band may not spend at one pixel
FAR = 100.0  # m, where the depth is unknown
BINS = 16  # of each Lab axis
ENOUGH = 200  # pixels to learn colours from
TOLD_APART = 0.8  # balanced accuracy from which colours count
THICKNESS = 1.9  # diameters: what is wider in the picture is no band
LOW_RIDGE = 0.5  # diameters by which the band stands out from what is around it
HIGH_RIDGE = 3.0  # the same where colours do not help: more than the shapes of a hand do
OFF_LINES = 3.0  # diameters: the taut band is a straight line, and calibrations are not perfect
HAND = 0.025  # m around the tool centre point that the fingers take
FINGER = 0.04  # m: a finger around the pads, where colours do not help
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
    - is nearer than what is usually seen there (which rejects the fork),
    - is not in the hand, and has a colour of the band rather than of the arm.
    Where the colours do not tell the two apart, more room around the hand is left out instead.
    """

    def __init__(self, view: View):
        self.scene = view.scene
        self.focal = float(view.recording.depth_camera.matrix[0, 0])
        depths, taut = [], []
        for _, frame in view.frames(every=max(1, len(view) // LEARNING_FRAMES)):
            depths.append(frame.depth)
            if self.scene.taut(frame.time):
                taut.append(frame)
        if not depths:
            raise UserError(f"{view.recording.path}: no camera frame in the window can be decoded")
        self.background = _background(np.stack(depths))
        self.likeness = _likeness(*self._samples(taut))

    def mask(self, frame: Frame) -> np.ndarray:
        scene, colors_tell = self.scene, self.likeness is not None
        found = self._candidates(frame, LOW_RIDGE if colors_tell else HIGH_RIDGE)
        rows, columns = np.nonzero(found)
        points = frame.points[rows, columns]
        if colors_tell:
            keep = ~_in_hand(points, scene, frame.time, HAND)
            keep &= self.likeness[_bins(frame.color[rows, columns])] > 0.5
        else:
            room = FINGER + scene.signals.opening_at(frame.time) / 2
            keep = ~_in_hand(points, scene, frame.time, room)
        if scene.taut(frame.time):
            keep &= distance_to_lines(points, scene, frame.time) < OFF_LINES * scene.diameter
        found[rows[~keep], columns[~keep]] = False
        return _large_enough(found, self.focal * scene.diameter / frame.depth[found])

    def _candidates(self, frame: Frame, ridge: float) -> np.ndarray:
        """Thin, new and near pixels, shape (H, W).

        They stand out by `ridge` diameters; just before the fork, where no arm fits, by LOW_RIDGE.
        """
        before = (self.background - frame.depth) / self.scene.diameter
        new = frame.near & (before > LOW_RIDGE)
        if not new.any():
            return new
        far = np.where(frame.depth > 0, frame.depth, FAR).astype(np.float32)
        width = THICKNESS * self.focal * self.scene.diameter / far
        sizes = 2 * np.round(width / 2).astype(np.int16) + 1
        ridges = np.where(before < 2 * ridge, LOW_RIDGE, ridge)
        stands_out = (ridges * self.scene.diameter).astype(np.float32)
        thin = np.zeros_like(new)
        for size in np.unique(sizes[new]):
            # A closing of the depth fills whatever is nearer and narrower than its kernel.
            kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (int(size), int(size)))
            filled = cv2.morphologyEx(far, cv2.MORPH_CLOSE, kernel)
            thin |= (sizes == size) & (filled - far > stands_out)
        return new & thin

    def _samples(self, frames: list[Frame]) -> tuple[np.ndarray, np.ndarray]:
        """Lab bins, shape (3, S), of pixels that are surely the band's, and of others that move."""
        diameter = self.scene.diameter
        band, other = [], []
        for frame in frames:
            moving = frame.near & (frame.depth < self.background - 2 * diameter)
            rest = frame.color[moving][_off(frame, moving, self.scene) > 3 * diameter]
            thin = self._candidates(frame, HIGH_RIDGE)
            sure = frame.color[thin][_off(frame, thin, self.scene) < 1.5 * diameter]
            band.append(np.stack(_bins(sure)))
            other.append(np.stack(_bins(rest)))
        empty = np.zeros((3, 0), np.intp)
        return np.hstack([empty, *band]), np.hstack([empty, *other])


def _background(depths: np.ndarray) -> np.ndarray:
    """What is seen at each pixel behind all that moves, (H, W) from (F, H, W); inf if unknown."""
    rank = int(BACKGROUND * (len(depths) - 1))
    return np.partition(np.where(depths > 0, depths, np.inf), rank, axis=0)[rank]


def _bins(colors: np.ndarray) -> tuple[np.ndarray, ...]:
    """Lab bins of BGR pixels, three arrays (S,) from (S, 3)."""
    if not len(colors):
        return (np.zeros(0, np.intp),) * 3
    lab = cv2.cvtColor(colors[None], cv2.COLOR_BGR2LAB)[0]
    return tuple((lab // (256 // BINS)).T.astype(np.intp))


def _likeness(band: np.ndarray, other: np.ndarray) -> np.ndarray | None:
    """Share of the band in each Lab bin, (B, B, B); None where colours do not tell it apart."""
    if min(band.shape[1], other.shape[1]) < ENOUGH:
        return None
    counts = []
    for samples in (band, other):
        histogram = np.zeros((BINS,) * 3)
        np.add.at(histogram, tuple(samples), 1.0)
        histogram = gaussian_filter(histogram, 0.7, mode="nearest")  # neighbours are alike
        counts.append(histogram / histogram.sum() + 1e-6)
    share = counts[0] / (counts[0] + counts[1])
    right = np.mean(share[tuple(band)] > 0.5) + np.mean(share[tuple(other)] <= 0.5)
    return share if right / 2 > TOLD_APART else None


def _off(frame: Frame, pixels: np.ndarray, scene: Scene) -> np.ndarray:
    return distance_to_lines(frame.points[pixels], scene, frame.time)


def distance_to_lines(points: np.ndarray, scene: Scene, time: float) -> np.ndarray:
    """Distance of points (S, 3) from the straight lines tip to hand, shape (S,)."""
    hand, distances = scene.signals.hand(time), []
    for tip in scene.tips:
        way = (hand - tip) / np.linalg.norm(hand - tip)
        along = np.clip((points - tip) @ way, 0, np.linalg.norm(hand - tip))
        distances.append(length(points - tip - along[:, None] * way))
    return np.minimum(*distances)


def _in_hand(points: np.ndarray, scene: Scene, time: float, room: float) -> np.ndarray:
    """Around the tool centre point, and behind it along the tool's axis, shape (S,)."""
    away = points - scene.signals.hand(time)
    behind = -(away @ scene.signals.tool_axis)
    aside = np.sqrt(np.maximum((away**2).sum(axis=-1) - behind**2, 0))
    palm = (behind > room) & (behind < PALM[0]) & (aside < PALM[1])
    return palm | (length(away) < room)


def _large_enough(found: np.ndarray, diameters: np.ndarray) -> np.ndarray:
    """Without specks: parts smaller than a piece of band as long as it is thick."""
    if not found.any():
        return found
    _, labels, stats, _ = cv2.connectedComponentsWithStats(found.astype(np.uint8), connectivity=8)
    large = stats[:, cv2.CC_STAT_AREA] >= np.median(diameters) ** 2
    large[0] = False
    return large[labels]
