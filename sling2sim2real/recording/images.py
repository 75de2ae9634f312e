"""Pictures to arrays: colour to BGR, depth to metres. Pillow unpacks them, and notices damage."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np
from PIL import Image

from sling2sim2real.recording.messages import Picture

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "JPEG2000", "AVIF")
KNOWN = "JPEG, PNG, WebP, TIFF, BMP, JPEG 2000 or AVIF"
JPEG_END = b"\xff\xd9"  # behind it is what a driver sends of its buffer
GREY = ("L", "I;16", "I", "F")  # modes of Pillow that are kept as they are
LARGEST = 2**24  # pixels of a raw picture; a damaged size must not ask for more


class Undecodable(Exception):
    """An image that cannot be decoded; the message says why."""


@contextmanager
def opened(data: np.ndarray) -> Iterator[Image.Image]:
    """A packed picture, whose header is read. Raises Undecodable, also of what is done with it."""
    try:
        with Image.open(io.BytesIO(data.data), formats=FORMATS) as image:
            yield image
    except Undecodable:
        raise
    except Exception as error:  # damaged bytes make Pillow raise anything
        kind = type(error).__name__  # its words hold addresses, which differ from run to run
        raise Undecodable(f"damaged image, or neither {KNOWN} ({kind})") from error


def unpacked(data: np.ndarray, kind: str) -> np.ndarray:
    """Pixels, grey (H, W) or RGB (H, W, 3); what follows on the picture's end is passed over.

    Args:
        data: uint8, shape (bytes,).
        kind: What the message says that it is.

    Raises:
        Undecodable: It is damaged, cut off or too large.
    """
    with opened(data) as image:
        if image.format == "JPEG" and JPEG_END not in data.tobytes():  # grey would fill it up
            raise Undecodable(f"JPEG is cut off ({kind})")
        if image.mode == "1":
            return np.asarray(image.convert("L"))
        return np.asarray(image if image.mode in GREY else image.convert("RGB"))


# compressed_depth_image_transport: format, depth quantisation A and B
DEPTH_HEADER = struct.Struct("<iff")
PNG = np.frombuffer(b"\x89PNG\r\n\x1a\n", np.uint8)
COLORS = {
    "rgb8": (3, cv2.COLOR_RGB2BGR),
    "rgba8": (4, cv2.COLOR_RGBA2BGR),
    "bgra8": (4, cv2.COLOR_BGRA2BGR),
    "mono8": (1, cv2.COLOR_GRAY2BGR),
    "bgr8": (3, None),
}
DEPTHS = {"16UC1": np.uint16, "32FC1": np.float32}  # millimetres, metres
FARTHEST = 1e6  # m or mm: floats beyond it are no depth
USE = "use 16UC1 (in millimetres) or 32FC1 (in metres)"


def is_depth(picture: Picture) -> bool:
    """Whether a picture says that it holds depth; a grey PNG of 16 bits is taken to."""
    if picture.encoding:
        return picture.encoding in DEPTHS
    if "compressedDepth" in picture.format or picture.format.startswith(tuple(DEPTHS)):
        return True
    try:
        with opened(picture.data) as image:
            return image.mode == "I;16"
    except Undecodable:
        return False


def color(picture: Picture) -> np.ndarray:
    """Decode a picture to BGR, shape (H, W, 3), uint8. Raises Undecodable."""
    if picture.format:
        if "compressedDepth" in picture.format:
            raise Undecodable(f"format {picture.format!r} is depth, not colour")
        pixels = unpacked(picture.data, picture.format)
        if pixels.ndim == 3:
            return cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR)
        grey = pixels if pixels.dtype == np.uint8 else (pixels >> 8).astype(np.uint8)
        return cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    if picture.encoding not in COLORS:
        raise Undecodable(f"colour encoding {picture.encoding!r} is not known, use rgb8 or bgr8")
    channels, conversion = COLORS[picture.encoding]
    pixels = _rows(picture, np.uint8, channels)
    return np.ascontiguousarray(pixels) if conversion is None else cv2.cvtColor(pixels, conversion)


def depth(picture: Picture) -> np.ndarray:
    """Decode a picture to metres, shape (H, W), float32, 0 where unknown. Raises Undecodable."""
    if not picture.format:
        if picture.encoding not in DEPTHS:
            raise Undecodable(f"depth encoding {picture.encoding!r} is not known, {USE}")
        return _metres(_rows(picture, DEPTHS[picture.encoding], 1))
    floats = picture.format.startswith("32FC1")
    if "compressedDepth" not in picture.format:
        if floats:
            raise Undecodable(f"depth format {picture.format!r} is not known, use compressedDepth")
        return _metres(unpacked(picture.data, picture.format))
    body = _body(picture.data)
    if len(body) == len(picture.data) and floats:
        raise Undecodable(
            f"depth format {picture.format!r} without the header of {DEPTH_HEADER.size} bytes that"
            " says how it is quantised: record the raw depth, or as 16UC1"
        )
    if not len(body):
        raise Undecodable("compressedDepth without a picture")
    if "rvl" in picture.format.lower():
        raise Undecodable("compressedDepth in RVL is not read: record it in PNG")
    packed = unpacked(body, picture.format)
    if not floats:
        return _metres(packed)
    _, scale, offset = DEPTH_HEADER.unpack_from(picture.data.data)
    with np.errstate(all="ignore"):
        quantised = np.where(packed > 0, scale / (packed - np.float32(offset)), 0)
    return _metres(quantised.astype(np.float32))


def grey(data: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A grey PNG of this width and height to uint8, shape (H, W). Raises Undecodable."""
    with opened(data) as image:
        if image.mode not in ("L", "1") or image.format != "PNG":
            raise Undecodable("is not a grey PNG of 8 bits or 1")
        if image.size != size:
            raise Undecodable("is of {} x {} pixels, not of {} x {}".format(*image.size, *size))
    return unpacked(data, "png")


def size_of(picture: Picture) -> tuple[int, int] | None:
    """Width and height without decoding; None where the header is damaged or not known."""
    if not picture.format:
        return picture.width, picture.height
    data = picture.data
    if "compressedDepth" in picture.format:
        data = _body(data)
    try:
        with opened(data) as image:
            return image.size
    except Undecodable:
        return None


def _body(data: np.ndarray) -> np.ndarray:
    """Return what follows a compressedDepth message's header, which some writers leave out."""
    return data if np.array_equal(data[: len(PNG)], PNG) else data[DEPTH_HEADER.size :]


def _rows(picture: Picture, kind: type, channels: int) -> np.ndarray:
    """Pixels of a raw picture without the padding at the ends of its rows."""
    order = np.dtype(kind).newbyteorder(">" if picture.is_bigendian else "<")
    width, height, step = picture.width, picture.height, picture.step
    used = width * channels * order.itemsize
    if not 0 < width * height <= LARGEST:
        raise Undecodable(f"raw image of {width} x {height} pixels")
    if step in (0, width, width * channels) and len(picture.data) == height * used:
        step = used  # drivers leave it out, or count pixels
    if step < used:
        raise Undecodable(
            f"raw image with step {step}: a row of {width} pixels of {picture.encoding} takes"
            f" {used} bytes"
        )
    if len(picture.data) != height * step:
        raise Undecodable(
            f"raw image of {len(picture.data)} bytes, {height} rows of {step} were said"
        )
    rows = picture.data.reshape(height, step)[:, :used]
    pixels = np.ascontiguousarray(rows).view(order).astype(kind, copy=False)
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def _metres(depth: np.ndarray) -> np.ndarray:
    """Integers of 16 bits hold millimetres, floats hold metres."""
    if depth.ndim != 2:
        raise Undecodable("a picture in colour is no depth image")
    if depth.dtype == np.uint16:
        return depth.astype(np.float32) / 1000
    if depth.dtype != np.float32:
        raise Undecodable(f"depth image of {depth.dtype}, {USE}")
    return np.where(np.isfinite(depth) & (depth > 0) & (depth < FARTHEST), depth, np.float32(0))
