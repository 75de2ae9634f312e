"""Pictures to arrays: colour to BGR, depth to metres."""

from __future__ import annotations

import struct

import cv2
import numpy as np

from pipeline.recording.input.packed import LARGEST, Undecodable, Unsupported, header, unpacked
from pipeline.recording.input.readings import Picture

__all__ = ["LARGEST", "Undecodable", "Unsupported"]

# compressed_depth_image_transport: format, depth quantisation A and B
DEPTH_HEADER = struct.Struct("<iff")
RVL_SIZE = struct.Struct("<II")  # columns, rows
LARGEST_RVL = 2**22  # pixels, whose decoding takes a hundred bytes for each
PNG = np.frombuffer(b"\x89PNG\r\n\x1a\n", np.uint8)
COLORS = {
    "rgb8": (3, cv2.COLOR_RGB2BGR),
    "rgba8": (4, cv2.COLOR_RGBA2BGR),
    "bgra8": (4, cv2.COLOR_BGRA2BGR),
    "mono8": (1, cv2.COLOR_GRAY2BGR),
    "8UC1": (1, cv2.COLOR_GRAY2BGR),
    "mono16": (1, cv2.COLOR_GRAY2BGR),
    "bgr8": (3, None),
    "8UC3": (3, None),
}
MILLIMETRES = {"16UC1": np.uint16, "mono16": np.uint16, "16SC1": np.int16}
METRES = {"32FC1": np.float32, "64FC1": np.float64}
DEPTHS = MILLIMETRES | METRES
NAMED = tuple(kind for kind in DEPTHS if kind != "mono16")  # which may be infrared
FARTHEST = 1e6  # m or mm: floats beyond it are no depth
USE = "use 16UC1 (in millimetres) or 32FC1 (in metres)"


def is_depth(picture: Picture) -> bool:
    """Whether a picture says that it holds depth; a grey PNG of 16 bits is taken to."""
    if picture.encoding or "compressedDepth" in picture.format:
        return picture.encoding in NAMED or "compressedDepth" in picture.format
    if picture.format.startswith(NAMED):
        return True
    try:
        return header(picture.data).mode == "I;16"
    except Undecodable:
        return False


def color(picture: Picture) -> np.ndarray:
    """Decode a picture to BGR, shape (H, W, 3), uint8. Raises Undecodable."""
    if picture.format:
        if "compressedDepth" in picture.format:
            raise Unsupported(f"format {picture.format!r} is depth, not colour")
        return unpacked(picture.data, cv2.IMREAD_COLOR, picture.format)
    if picture.encoding not in COLORS:
        raise Unsupported(f"colour encoding {picture.encoding!r} is not known, use rgb8 or bgr8")
    channels, conversion = COLORS[picture.encoding]
    pixels = _rows(picture, np.uint16 if picture.encoding == "mono16" else np.uint8, channels)
    if picture.encoding == "mono16":
        pixels = (pixels >> 8).astype(np.uint8)
    return np.ascontiguousarray(pixels) if conversion is None else cv2.cvtColor(pixels, conversion)


def depth(picture: Picture) -> np.ndarray:
    """Decode a picture to metres, shape (H, W), float32, 0 where unknown. Raises Undecodable."""
    if not picture.format:
        if picture.encoding not in DEPTHS:
            raise Unsupported(f"depth encoding {picture.encoding!r} is not known, {USE}")
        return _metres(_rows(picture, DEPTHS[picture.encoding], 1))
    floats = picture.format.startswith("32FC1")
    if "compressedDepth" not in picture.format:
        pixels = unpacked(picture.data, cv2.IMREAD_UNCHANGED, picture.format)
        if floats and pixels.dtype != np.float32:
            raise Unsupported(f"depth format {picture.format!r} is not known, use compressedDepth")
        return _metres(pixels)
    body = _body(picture.data)
    if len(body) == len(picture.data) and floats:
        raise Unsupported(
            f"depth format {picture.format!r} without the header of {DEPTH_HEADER.size} bytes that"
            " says how it is quantised: record the raw depth, or as 16UC1"
        )
    if not len(body):
        raise Undecodable("compressedDepth without a picture")
    is_rvl = "rvl" in picture.format.lower()
    packed = rvl(body) if is_rvl else unpacked(body, cv2.IMREAD_UNCHANGED, picture.format)
    if not floats:
        return _metres(packed)
    _, scale, offset = DEPTH_HEADER.unpack_from(picture.data.data)
    with np.errstate(all="ignore"):
        quantised = np.where(packed > 0, scale / (packed - np.float32(offset)), 0)
    return _metres(quantised.astype(np.float32))


def grey(data: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A grey PNG of this width and height to uint8, shape (H, W). Raises Undecodable."""
    try:
        pixels, mode, format = header(data)
    except Undecodable as error:
        raise Undecodable(f"is not a grey PNG of 8 bits or 1: {error}") from error
    if mode not in ("L", "1") or format != "PNG":
        raise Undecodable("is not a grey PNG of 8 bits or 1")
    if pixels != size:
        raise Undecodable("is of {} x {} pixels, not of {} x {}".format(*pixels, *size))
    return unpacked(data, cv2.IMREAD_GRAYSCALE, "png")


def size_of(picture: Picture) -> tuple[int, int] | None:
    """Width and height without decoding; None where the header is damaged or not known."""
    if not picture.format:
        return picture.width, picture.height
    data = picture.data
    if "compressedDepth" in picture.format:
        data = _body(data)
        if "rvl" in picture.format.lower():
            return RVL_SIZE.unpack_from(data.data) if len(data) >= RVL_SIZE.size else None
    try:
        return header(data).size
    except Undecodable:
        return None


def _body(data: np.ndarray) -> np.ndarray:
    """Return what follows a compressedDepth message's header, which some writers leave out."""
    return data if np.array_equal(data[: len(PNG)], PNG) else data[DEPTH_HEADER.size :]


def rvl(data: np.ndarray) -> np.ndarray:
    """Run-length and variable-length coded depth, shape (H, W), uint16. Raises Undecodable.

    Wilson, "Fast Lossless Depth Image Compression", ISS 2017. The packages at hand take data that
    are cut off or damaged without a word, so it is decoded here, nearly all of it in NumPy.
    """
    if len(data) < RVL_SIZE.size:
        raise Undecodable("RVL without a picture")
    width, height = RVL_SIZE.unpack_from(data.data)
    pixels = width * height
    if not 0 < pixels <= LARGEST_RVL or len(data) > RVL_SIZE.size + 4 * pixels + 4:
        raise Undecodable(f"RVL of {len(data)} bytes, {width} x {height} pixels")
    words = data[RVL_SIZE.size :][: (len(data) - RVL_SIZE.size) // 4 * 4].reshape(-1, 4)
    octets = words[:, ::-1].ravel()  # the nibbles of a word begin at its highest bits
    nibbles = np.stack([octets >> 4, octets & 15], axis=1).ravel()
    # A value is its nibbles' lower three bits, the lowest first; the last one lacks the bit 8.
    ends = np.flatnonzero(nibbles < 8)[: 3 * pixels + 2]  # each run, of at least a pixel, has two
    starts = np.concatenate([[0], ends[:-1] + 1])
    lengths = ends - starts
    if not len(ends) or lengths.max() > 9:  # more than 30 bits
        raise Undecodable("damaged RVL")
    values = (nibbles[starts] & 7).astype(np.int64)
    for more in range(1, int(lengths.max()) + 1):
        longer = np.flatnonzero(lengths >= more)
        values[longer] |= (nibbles[starts[longer] + more] & 7).astype(np.int64) << (3 * more)

    # Runs: how many pixels lack a depth, how many have one, and each one's change of depth.
    first_pixels, first_values, counts = [], [], []
    pixel = at = 0
    numbers = values.tolist()
    while pixel < pixels:
        if at + 1 >= len(numbers):
            raise Undecodable("RVL is cut off")
        zeros, count = numbers[at], numbers[at + 1]
        pixel, at = pixel + zeros, at + 2
        if zeros + count == 0 or pixel + count > pixels or at + count > len(numbers):
            raise Undecodable("damaged RVL")
        first_pixels.append(pixel)
        first_values.append(at)
        counts.append(count)
        pixel, at = pixel + count, at + count
    zigzag = values[_within(first_values, counts, len(values))]
    depth = np.zeros(pixels, np.uint16)
    depth[_within(first_pixels, counts, pixels)] = np.cumsum((zigzag >> 1) ^ -(zigzag & 1)) & 0xFFFF
    return depth.reshape(height, width)


def _within(firsts: list[int], counts: list[int], size: int) -> np.ndarray:
    """Mask of runs that do not overlap, shape (size,)."""
    begins = np.bincount(firsts, minlength=size + 1)
    ends = np.bincount(np.add(firsts, counts), minlength=size + 1)
    return np.cumsum(begins - ends)[:size] > 0


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
        raise Unsupported("a picture in colour is no depth image")
    if depth.dtype in MILLIMETRES.values():
        return np.maximum(depth, 0).astype(np.float32) / 1000
    if depth.dtype not in METRES.values():
        raise Unsupported(f"depth image of {depth.dtype}, {USE}")
    measured = np.isfinite(depth) & (depth > 0) & (depth < FARTHEST)
    return np.where(measured, depth, 0).astype(np.float32)
