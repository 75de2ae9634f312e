"""Camera messages to arrays, and pinhole cameras with distortion."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import cv2
import numpy as np

DEPTH_HEADER = struct.Struct("<iff")  # compressedDepth: format, depth quantisation A and B
COLORS = {
    "rgb8": cv2.COLOR_RGB2BGR,
    "rgba8": cv2.COLOR_RGBA2BGR,
    "bgra8": cv2.COLOR_BGRA2BGR,
    "mono8": cv2.COLOR_GRAY2BGR,
    "8UC1": cv2.COLOR_GRAY2BGR,
    "bgr8": None,
    "8UC3": None,
}
DEPTHS = ("16UC1", "mono16", "32FC1")


class Undecodable(Exception):
    """An image that cannot be decoded; the message says why."""


def is_depth(message: object) -> bool:
    """Whether an Image or CompressedImage says that it holds depth."""
    text = getattr(message, "encoding", None) or message.format
    return "compressedDepth" in text or text.startswith(DEPTHS)


def color(message: object) -> np.ndarray:
    """Image or CompressedImage to BGR, shape (H, W, 3), uint8. Raises Undecodable."""
    if hasattr(message, "format"):
        return _unpacked(message.data, cv2.IMREAD_COLOR, message.format)
    if message.encoding not in COLORS:
        raise Undecodable(f"colour encoding {message.encoding!r} is not known")
    pixels = _rows(message, np.dtype(np.uint8))
    conversion = COLORS[message.encoding]
    return np.ascontiguousarray(pixels) if conversion is None else cv2.cvtColor(pixels, conversion)


def depth(message: object) -> np.ndarray:
    """Image or CompressedImage to metres, shape (H, W), float32, 0 where unknown.

    Raises:
        Undecodable: with the reason.
    """
    if not hasattr(message, "format"):
        if message.encoding not in DEPTHS:
            raise Undecodable(f"depth encoding {message.encoding!r} is not known")
        kind = np.float32 if message.encoding == "32FC1" else np.uint16
        order = ">" if message.is_bigendian else "<"
        return _metres(_rows(message, np.dtype(kind).newbyteorder(order)))
    if "compressedDepth" not in message.format:
        return _metres(_unpacked(message.data, cv2.IMREAD_UNCHANGED, message.format))
    if "rvl" in message.format.lower():
        raise Undecodable("compressedDepth in RVL is not supported, record it as PNG")
    _, scale, offset = DEPTH_HEADER.unpack_from(bytes(message.data[: DEPTH_HEADER.size]))
    packed = _unpacked(message.data[DEPTH_HEADER.size :], cv2.IMREAD_UNCHANGED, message.format)
    if not message.format.startswith("32FC1"):
        return _metres(packed)
    with np.errstate(divide="ignore"):
        return _metres(np.where(packed > 0, scale / (packed - np.float32(offset)), 0))


def _unpacked(data: np.ndarray, flags: int, kind: str) -> np.ndarray:
    image = cv2.imdecode(np.asarray(data, np.uint8), flags) if len(data) else None
    if image is None:
        raise Undecodable(f"damaged or unknown image ({kind})")
    return image


def _rows(message: object, kind: np.dtype) -> np.ndarray:
    """Pixels of a raw Image without the padding at the ends of its rows."""
    try:
        rows = np.asarray(message.data, np.uint8).reshape(message.height, message.step)
        channels = {"rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4}
        width = message.width * channels.get(message.encoding, 1)
        pixels = np.ascontiguousarray(rows[:, : width * kind.itemsize]).view(kind)
        return pixels.reshape(message.height, message.width, -1).squeeze()
    except ValueError as error:
        raise Undecodable(f"raw image of another size than it says ({error})") from error


def _metres(depth: np.ndarray) -> np.ndarray:
    """uint16 holds millimetres, floats hold metres."""
    if depth.ndim != 2:
        raise Undecodable("depth image with more than one channel")
    if depth.dtype == np.uint16:
        return depth.astype(np.float32) / 1000
    return np.nan_to_num(depth.astype(np.float32), nan=0, posinf=0, neginf=0)


@dataclass(frozen=True)
class Camera:
    """Intrinsics of CameraInfo: plumb_bob with 0, 5 or 8 coefficients or rational_polynomial."""

    width: int
    height: int
    matrix: np.ndarray  # (3, 3)
    distortion: np.ndarray  # (0, 4, 5 or 8,)
    frame: str

    def rays(self) -> np.ndarray:
        """What each pixel looks along, scaled to z = 1, shape (H, W, 3)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        pixels = np.stack([u, v], axis=-1).reshape(-1, 1, 2).astype(np.float64)
        rays = cv2.undistortPoints(pixels, self.matrix, self.distortion)
        rays = cv2.convertPointsToHomogeneous(rays)
        return rays.reshape(self.height, self.width, 3)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (u, v), shape (N, 2), of points in the camera's frame, shape (N, 3), z > 0."""
        if not len(points):
            return np.zeros((0, 2))
        points = np.asarray(points, np.float64).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(
            points, np.zeros(3), np.zeros(3), self.matrix, self.distortion
        )
        return pixels.reshape(-1, 2)
