"""Camera frames as the mask sees them: where the band can be, in frame O."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import images
from sling2sim2real.recording.frames import Geometry
from sling2sim2real.recording.signals import Signals
from sling2sim2real.recording.streams import Recording
from sling2sim2real.settings.lab import BandParams, SetupParams

PAIRING = 0.5  # of a frame's period: colour and depth further apart are not one picture
SPARE = 0.05  # of the length, for the accuracy of what was measured
TAUT = 1.05  # stretch from which the held band is two straight lines
UNKNOWN = 1000.0  # m, where the depth is not known
CLOSEST = 0.05  # m before the colour camera
BLIND = 0.15  # m before the depth camera that it cannot measure: what is said to be there is not
HIDDEN = 0.02  # m behind what the colour camera sees, from which on a point is hidden
RECOIL = 0.25  # s after the release in which the band may be longer than when it hangs


def length(vectors: np.ndarray) -> np.ndarray:
    """Euclidean length along the last axis, faster than numpy.linalg.norm on short ones."""
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


def onto_depth(picture: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """What a colour picture shows at `pixels` (H, W, 2), 0 where they are -1."""
    nowhere = cast(np.ndarray, None)  # `pixels` holds both maps, of which OpenCV's stubs know not
    return cv2.remap(
        picture, pixels, nowhere, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0
    )


@dataclass(frozen=True)
class RgbdFrame:
    """One picture, cropped; H x W pixels of the depth image.

    Attributes:
        number: Of the pictures of the view.
        time: Its stamp, seconds since the window's start.
        color: BGR, shape (H, W, 3), uint8; black where the colour camera does not see the point.
        depth: Metres, shape (H, W), 0 where unknown.
        points: Frame O, shape (H, W, 3); far away where the depth is unknown.
        near: Pixels that the band can reach, shape (H, W).
        pixels: Where in the colour picture each is seen, shape (H, W, 2), -1 where it is not; None
            where the depth is registered to colour.
    """

    number: int
    time: float
    color: np.ndarray
    depth: np.ndarray
    points: np.ndarray
    near: np.ndarray
    pixels: np.ndarray | None


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
    def of(cls, band: BandParams, setup: SetupParams, signals: Signals) -> Scene:
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

    def reach_of_half(self, time: float) -> float:
        """No point of the held band is further from its tip and the hand together than this [m]."""
        return self.rest_length * (max(self.stretch(time), 1.0) / 2 + SPARE) + 2 * self.diameter


class View:
    """Decodes the frames of a recording within the window, one at a time.

    Raises:
        UserError: The camera looks elsewhere.
    """

    def __init__(self, recording: Recording, geometry: Geometry, scene: Scene, duration: float):
        self.recording, self.geometry, self.scene = recording, geometry, scene
        origin = scene.signals.origin
        times = recording.depth.seconds(origin)
        color_times = recording.color.seconds(origin)
        pairs = [int(np.argmin(np.abs(color_times - t))) for t in times]
        tolerance = PAIRING * recording.depth.period
        within = (times >= 0) & (times < duration)
        paired = np.abs(color_times[pairs] - times) < tolerance
        self.index = [(k, pairs[k]) for k in np.flatnonzero(within & paired).tolist()]
        self.unpaired = int(np.sum(within & ~paired))
        self.times = np.array([times[k] for k, _ in self.index])
        self.damaged: dict[int, str] = {}  # which of its two pictures cannot be decoded
        self.window = self._window()
        if any(side.start >= side.stop for side in self.window):
            raise UserError(
                f"{recording.path}: the camera looks past where the band can be: check its pose in"
                " /tf_static or setup.camera_to_fork"
            )
        self.rays = recording.depth_camera.rays().astype(np.float32)  # (H, W, 3)

    def __len__(self) -> int:
        return len(self.index)

    def frames(
        self, numbers: Iterable[int] | None = None, *, whole: bool = False
    ) -> Iterator[tuple[int, RgbdFrame]]:
        """Yield (number, frame) of these or all frames; damaged ones are left out and counted.

        `whole` pictures are not cropped to what sees where the band can be.
        """
        window = (slice(None), slice(None)) if whole else self.window
        for number in range(len(self.index)) if numbers is None else numbers:
            depth, color = self.depth(number), self.color(number)
            if depth is None or color is None:
                self.damaged[number] = "depth" if depth is None else "color"
            else:
                yield number, self.rgbd_frame(number, depth, color, window)

    def depth(self, number: int) -> np.ndarray | None:
        """A depth picture [m], 0 where unknown, of the camera's size; None where it is damaged."""
        return self.recording.depth_picture(self.index[number][0])

    def color(self, number: int) -> np.ndarray | None:
        """A colour picture as it was recorded, BGR; None where it is damaged."""
        try:
            return images.color(self.recording.color.values[self.index[number][1]])
        except images.Undecodable:
            return None

    def undecoded(self, role: str) -> UserError:
        """That no picture of this role can be decoded."""
        return UserError(
            f"{self.recording.path}: no picture of {getattr(self.recording, role).topic} between"
            " the window's start and end can be decoded, or is of its camera info's size"
        )

    def stamp(self, number: int) -> int:
        """Stamp in a colour picture's header, as it was recorded [ns]."""
        return self.recording.color.values[self.index[number][1]].stamp

    def marked(self, picture: np.ndarray, frame: RgbdFrame) -> np.ndarray:
        """What a mask of the colour picture marks where the band can be: (H, W) as in `frame`.

        Args:
            picture: Of the colour camera's size, bool.
        """
        seen = picture.astype(np.float32)
        seen = seen[self.window] if frame.pixels is None else onto_depth(seen, frame.pixels)
        return (seen > 0.5) & frame.near

    def rgbd_frame(
        self,
        number: int,
        depth: np.ndarray,
        color: np.ndarray,
        window: tuple[slice, slice] | None = None,
    ) -> RgbdFrame:
        """The frame of two decoded pictures."""
        window = window or self.window
        depth = depth[window]
        known = np.where(depth > 0, depth, np.float32(UNKNOWN))
        seen = cv2.multiply(self.rays[window], cv2.merge([known] * 3))
        camera = self.geometry.camera
        affine = np.column_stack([camera.rotation.as_matrix(), camera.translation])
        points = cv2.transform(seen, affine.astype(np.float32))
        time = float(self.times[number])
        pixels = None if self._registered(color) else self._pixels(color, seen)
        color = color[window] if pixels is None else onto_depth(color, pixels)
        near = self._near(points, time) & (depth > BLIND)
        return RgbdFrame(number, time, color, depth, points, near, pixels)

    def _near(self, points: np.ndarray, time: float) -> np.ndarray:
        """Pixels of points (H, W, 3) above the floor that the band's length allows."""
        scene, holds = self.scene, self.scene.holds(time)
        places = np.array([*scene.tips, scene.signals.hand(time)])[: 3 if holds else 2]
        # |x - p|^2 = x.x - 2 p.x + p.p: affine maps of all pixels, which OpenCV does fastest.
        affine = np.column_stack([-2 * places, np.einsum("ij,ij->i", places, places)])
        square = cv2.transform(cv2.multiply(points, points), np.ones((1, 3), np.float32))
        away = [
            cv2.sqrt(np.maximum(cv2.transform(points, row[None]) + square, 0))
            for row in affine.astype(np.float32)
        ]
        near = away[0] + away[1] < scene.reach(time)
        if holds:
            near &= np.minimum(away[0], away[1]) + away[2] < scene.reach_of_half(time)
        return near & (points[..., 2] > scene.floor + 2 * scene.diameter)

    def _pixels(self, color: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Where the colour camera sees each point (H, W, 3) of the depth camera's frame."""
        in_color = self.geometry.color.apply(seen.reshape(-1, 3))
        ahead = in_color[:, 2] > CLOSEST
        pixels = np.full((len(in_color), 2), -1, np.float32)
        pixels[ahead] = self.recording.color_camera.project(in_color[ahead])
        height, width = color.shape[:2]
        cells = np.round(pixels).astype(np.int64)
        inside = np.asarray(np.all((cells >= 0) & (cells < (width, height)), axis=1))
        places = cells[inside, 1] * width + cells[inside, 0]
        depths = in_color[inside, 2]
        nearest = np.full(height * width, np.float32(UNKNOWN))
        np.minimum.at(nearest, places, depths)
        # Depth pixels may lie some colour pixels apart, so a surface hides what is between them.
        nearest = cv2.erode(nearest.reshape(height, width), np.ones((3, 3))).ravel()
        inside[inside] = depths < nearest[places] + HIDDEN
        pixels[~inside] = -1
        return pixels.reshape(*seen.shape[:2], 2)

    def _registered(self, color: np.ndarray) -> bool:
        a, b = self.recording.color_camera, self.recording.depth_camera
        if a.frame != b.frame or color.shape[:2] != (b.height, b.width):
            return False
        return np.allclose(a.matrix, b.matrix) and np.array_equal(a.distortion, b.distortion)

    def _window(self) -> tuple[slice, slice]:
        """The rectangle of the depth image that sees where the band can be."""
        camera = self.recording.depth_camera
        reach = max(self.scene.reach(t) for t in (0.0, *self.scene.signals.time))
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
        return camera.window(np.floor(pixels.min(axis=0)) - 5, np.ceil(pixels.max(axis=0)) + 6)


LOOKS = 15  # pictures that are looked at
AROUND = 4  # pixels to each side of the hand
FITS = 1.3  # by which factor the hand's depth may be off for what covers it


def why_no_band(view: View) -> str:
    """What of the depth does not go with where the hand is, "" where all does."""
    camera, place = view.recording.depth_camera, view.geometry.camera.inverse()
    factors = []
    for number in np.linspace(0, len(view) - 1, LOOKS).astype(int).tolist():
        depth, hand = view.depth(number), place.apply(view.scene.signals.hand(view.times[number]))
        if depth is None or hand[2] <= 0:
            continue
        pixel = np.round(camera.project(hand[None])[0])
        near = depth[camera.window(pixel - AROUND, pixel + AROUND + 1)]
        if near.any():
            factors.append(float(np.median(near[near > 0])) / hand[2])
    if not factors:
        return "there is no depth where the hand must be: does the emitter blink?"
    factor = float(f"{np.median(factors):.2g}")
    if 1 / FITS < factor < FITS:
        return ""
    return (
        f"the depth is about {factor:g} times what it must be at the hand: publish it as 16UC1 in"
        " millimetres or 32FC1 in metres, of the byte order that it says, or check the camera's"
        " pose and camera_info"
    )
