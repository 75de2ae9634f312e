"""Camera frames as the mask sees them: where the band can be, in frame O."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.recording import images
from pipeline.recording.geometry import Geometry
from pipeline.recording.reader import Recording
from pipeline.recording.signals import Signals

PAIRING = 0.5  # of a frame's period: colour and depth further apart are not one picture
SPARE = 0.05  # of the length, for the accuracy of what was measured
TAUT = 1.05  # stretch from which the held band is two straight lines
UNKNOWN = 1000.0  # m, where the depth is not known
RECOIL = 0.5  # s after the release in which the band may be longer than when it hangs


def length(vectors: np.ndarray) -> np.ndarray:
    """Euclidean length along the last axis, faster than numpy.linalg.norm on short ones."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


@dataclass(frozen=True)
class Frame:
    """One picture, cropped; H x W pixels of the depth image.

    Attributes:
        time: Its stamp, seconds since the window's start.
        color: BGR, shape (H, W, 3), uint8.
        depth: Metres, shape (H, W), 0 where unknown.
        points: Frame O, shape (H, W, 3); far away where the depth is unknown.
        near: Pixels that the band can reach, shape (H, W).
    """

    time: float
    color: np.ndarray
    depth: np.ndarray
    points: np.ndarray
    near: np.ndarray


@dataclass(frozen=True)
class Scene:
    """What is known of the scene without looking: fork, floor, band, hand.

    Attributes:
        tips: Fork tips, shape (2, 3).
        floor: Height of the floor [m].
        diameter, rest_length: Of the band [m].
        signals: Where the hand is, and when it holds the band.
    """

    tips: np.ndarray
    floor: float
    diameter: float
    rest_length: float
    signals: Signals

    @classmethod
    def of(cls, band: object, setup: object, signals: Signals) -> Scene:
        tips = np.array([[-0.5, 0, 0], [0.5, 0, 0]]) * setup.fork_width
        return cls(tips, -setup.fork_height, band.diameter, band.rest_length, signals)

    def holds(self, time: float) -> bool:
        return self.signals.grasp_time <= time < self.signals.release_time

    def stretch(self, time: float) -> float:
        """Way from tip to hand to tip, as a multiple of the rest length."""
        hand = self.signals.hand(time)
        return float(np.linalg.norm(self.tips - hand, axis=1).sum()) / self.rest_length

    def taut(self, time: float) -> bool:
        """Whether the hand draws the band into two straight lines."""
        return self.holds(time) and self.stretch(time) > TAUT

    def reach(self, time: float) -> float:
        """No point of the band is further from both tips together than this [m]."""
        length = 1.0
        if self.holds(time):
            length = self.stretch(time)
        elif 0 <= time - self.signals.release_time < RECOIL:
            length = self.stretch(self.signals.release_time)
        return (1 + SPARE) * self.rest_length * max(length, 1.1) + 2 * self.diameter

    def furthest_reach(self) -> float:
        return max(self.reach(t) for t in (0.0, *self.signals.time))


class View:
    """Decodes the frames of a recording within the window, one at a time."""

    def __init__(self, recording: Recording, geometry: Geometry, scene: Scene, duration: float):
        self.recording, self.geometry, self.scene = recording, geometry, scene
        origin = scene.signals.origin
        times = recording.depth.seconds(origin)
        color_times = recording.color.seconds(origin)
        pairs = [int(np.argmin(np.abs(color_times - t))) for t in times]
        tolerance = PAIRING * recording.depth.period
        within = (times >= 0) & (times < duration)
        paired = np.abs(color_times[pairs] - times) < tolerance
        self.index = [(k, pairs[k]) for k in np.flatnonzero(within & paired)]
        self.unpaired = int(np.sum(within & ~paired))
        self.times = np.array([times[k] for k, _ in self.index])
        self.damaged: set[int] = set()
        self.window = self._window()
        self.rays = recording.depth_camera.rays()[self.window].astype(np.float32)  # (H, W, 3)

    def __len__(self) -> int:
        return len(self.index)

    def frames(self, every: int = 1) -> Iterator[tuple[int, Frame]]:
        """Yield (number, frame) of every so many frames; damaged ones are left out and counted."""
        for number in range(0, len(self.index), every):
            frame = self._frame(number)
            if frame is not None:
                yield number, frame

    def _frame(self, number: int) -> Frame | None:
        k, c = self.index[number]
        camera = self.recording.depth_camera
        try:
            depth = images.depth(self.recording.depth.values[k])
            color = images.color(self.recording.color.values[c])
        except images.Undecodable:
            self.damaged.add(number)
            return None
        if depth.shape != (camera.height, camera.width):
            self.damaged.add(number)
            return None
        depth = depth[self.window]
        seen = self.rays * np.where(depth > 0, depth, np.float32(UNKNOWN))[..., None]
        points = self.geometry.camera.apply(seen.reshape(-1, 3)).reshape(seen.shape)
        time = float(self.times[number])
        return Frame(time, self._colors(color, seen), depth, points, self._near(points, time))

    def _near(self, points: np.ndarray, time: float) -> np.ndarray:
        left, right = self.scene.tips.astype(np.float32)
        way = length(points - left) + length(points - right)
        above = points[..., 2] > self.scene.floor + 2 * self.scene.diameter
        return (way < self.scene.reach(time)) & above

    def _colors(self, color: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Colour of each depth pixel; through the colour camera where the depth is its own."""
        if self._registered(color):
            return color[self.window]
        in_color = self.geometry.color.apply(seen.reshape(-1, 3))
        pixels = self.recording.color_camera.project(in_color).astype(np.float32)
        pixels = np.where(in_color[:, 2:] > 0, pixels, -1).reshape(*seen.shape[:2], 2)
        return cv2.remap(color, pixels, None, cv2.INTER_LINEAR)

    def _registered(self, color: np.ndarray) -> bool:
        a, b = self.recording.color_camera, self.recording.depth_camera
        if a.frame != b.frame or color.shape[:2] != (b.height, b.width):
            return False
        return np.allclose(a.matrix, b.matrix) and np.array_equal(a.distortion, b.distortion)

    def _window(self) -> tuple[slice, slice]:
        """The rectangle of the depth image that sees where the band can be."""
        camera, reach = self.recording.depth_camera, self.scene.furthest_reach()
        half, foci = reach / 2, np.linalg.norm(self.scene.tips[1] - self.scene.tips[0]) / 2
        minor = np.sqrt(max(half**2 - foci**2, 1e-6))
        sphere = np.random.default_rng(0).normal(size=(2000, 3))
        sphere /= np.linalg.norm(sphere, axis=1, keepdims=True)
        points = sphere * [half, minor, minor]
        points = np.maximum(points, [-np.inf, -np.inf, self.scene.floor])
        seen = self.geometry.camera.inverse().apply(points)
        pixels = camera.project(seen[seen[:, 2] > 0.05])
        if not len(pixels):
            return slice(0, camera.height), slice(0, camera.width)
        size = np.array([camera.width, camera.height])
        low = np.clip(np.floor(pixels.min(axis=0)) - 5, 0, size).astype(int)
        high = np.clip(np.ceil(pixels.max(axis=0)) + 6, 0, size).astype(int)
        return slice(low[1], high[1]), slice(low[0], high[0])
