"""Pictures to arrays: colour to BGR, depth to metres. Pillow unpacks them, and notices damage."""

from __future__ import annotations

import io
import struct

import cv2
import numpy as np
from PIL import Image

from sling2sim2real.recording.messages import Picture

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "JPEG2000", "AVIF")
KNOWN = "JPEG, PNG, WebP, TIFF, BMP, JPEG 2000 or AVIF"
JPEG, JPEG_END = b"\xff\xd8\xff", b"\xff\xd9"  # behind it is what a driver sends of its buffer
GREY = ("L", "I;16", "I", "F")  # modes of Pillow that are kept as they are
LARGEST = 2**24  # pixels of a raw picture; a damaged size must not ask for more
# compressed_depth_image_transport: format, depth quantisation A and B
DEPTH_HEADER = struct.Struct("<iff")
PNG = b"\x89PNG\r\n\x1a\n"
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


class Undecodable(Exception):
    """An image that cannot be decoded to what is asked for; the message says why."""


def unpacked(data: np.ndarray, kind: str) -> np.ndarray:
    """Pixels, grey (H, W) or RGB (H, W, 3); what follows on the picture's end is passed over.

    Args:
        data: uint8, shape (bytes,).
        kind: What the message says that it is.

    Raises:
        Undecodable: It is damaged, cut off or too large.
    """
    try:
        with Image.open(io.BytesIO(data.data), formats=FORMATS) as image:
            if image.format == "JPEG" and JPEG_END not in data.tobytes():  # grey would fill it up
                raise Undecodable(f"{kind}: JPEG is cut off")
            pixels = image.convert("L") if image.mode == "1" else image
            return np.asarray(pixels if pixels.mode in GREY else pixels.convert("RGB"))
    except Undecodable:
        raise
    except Exception as error:  # damaged bytes make Pillow raise anything
        name = type(error).__name__  # its words hold addresses, which differ from run to run
        raise Undecodable(f"{kind}: damaged image, or neither {KNOWN} ({name})") from error


def color(picture: Picture) -> np.ndarray:
    """Decode a picture to BGR, shape (H, W, 3), uint8. Raises Undecodable."""
    if picture.encoding:
        if picture.encoding not in COLORS:
            raise Undecodable(f"encoding {picture.encoding!r} is no known colour, use rgb8 or bgr8")
        channels, conversion = COLORS[picture.encoding]
        pixels = _rows(picture, np.uint8, channels)
        if conversion is None:
            return np.ascontiguousarray(pixels)
        return cv2.cvtColor(pixels, conversion)
    if "compressedDepth" in picture.format:
        raise Undecodable(f"format {picture.format!r} is depth, not colour")
    pixels = unpacked(picture.data, picture.format)
    if pixels.dtype != np.uint8:
        raise Undecodable(f"{picture.format}: grey of {pixels.dtype} is depth, not colour")
    return cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR if pixels.ndim == 3 else cv2.COLOR_GRAY2BGR)


def depth(picture: Picture) -> np.ndarray:
    """Decode a picture to metres, shape (H, W), float32, 0 where unknown. Raises Undecodable."""
    if picture.encoding:
        if picture.encoding not in DEPTHS:
            raise Undecodable(f"encoding {picture.encoding!r} is no depth, {USE}")
        return _metres(_rows(picture, DEPTHS[picture.encoding], 1))
    data, floats = picture.data, picture.format.startswith("32FC1")
    if data.tobytes().startswith(JPEG):
        raise Undecodable(f"{picture.format}: a JPEG is no depth, {USE}")
    # Some writers leave the header out.
    headed = "compressedDepth" in picture.format and not data.tobytes().startswith(PNG)
    if floats and not headed:
        raise Undecodable(
            f"depth format {picture.format!r} without the header of {DEPTH_HEADER.size} bytes that"
            " says how it is quantised: record the raw depth, or as 16UC1"
        )
    pixels = unpacked(data[DEPTH_HEADER.size :] if headed else data, picture.format)
    if not floats:
        return _metres(pixels)
    _, scale, offset = DEPTH_HEADER.unpack_from(data.data)
    with np.errstate(all="ignore"):
        quantised = np.where(pixels > 0, scale / (pixels - np.float32(offset)), 0)
    return _metres(quantised.astype(np.float32))


def _rows(picture: Picture, kind: type, channels: int) -> np.ndarray:
    """Pixels of a raw picture without the padding at the ends of its rows."""
    order = np.dtype(kind).newbyteorder(">" if picture.is_bigendian else "<")
    width, height, step = picture.width, picture.height, picture.step
    used, size = width * channels * order.itemsize, len(picture.data)
    if step in (0, width, width * channels) and size == height * used:
        step = used  # drivers leave it out, or count pixels
    if not (0 < width * height <= LARGEST and step >= used and size == height * step):
        raise Undecodable(
            f"{width} x {height} pixels of {picture.encoding} cannot be {height} rows of {step}"
            f" bytes, in {size}"
        )
    rows = picture.data.reshape(height, step)[:, :used]
    pixels = np.ascontiguousarray(rows).view(order).astype(kind, copy=False)
    return pixels if channels == 1 else pixels.reshape(height, width, channels)


def _metres(depth: np.ndarray) -> np.ndarray:
    """Integers of 16 bits hold millimetres, floats hold metres."""
    if depth.ndim != 2 or depth.dtype not in DEPTHS.values():
        raise Undecodable(f"a picture of {depth.dtype} or in colour is no depth, {USE}")
    if depth.dtype == np.uint16:
        return depth.astype(np.float32) / 1000
    return np.where(np.isfinite(depth) & (depth > 0) & (depth < FARTHEST), depth, np.float32(0))
