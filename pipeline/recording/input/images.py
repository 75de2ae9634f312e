"""Pictures to arrays: colour to BGR, depth to metres."""

from __future__ import annotations

import io
import struct
import zlib

import cv2
import numpy as np
from PIL import Image

from pipeline.recording.input.readings import Picture

# compressed_depth_image_transport: format, depth quantisation A and B
DEPTH_HEADER = struct.Struct("<iff")
PNG_CHUNK = struct.Struct(">I4s")  # length, type
RVL_SIZE = struct.Struct("<II")  # columns, rows
SCANS = 100  # of a JPEG, of which each asks to go over all its pixels again
LARGEST_RVL = 2**22  # pixels, whose decoding takes a hundred bytes for each
LARGEST = 2**24  # pixels; a damaged size must not ask for more memory than this
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
DEPTHS = {"16UC1": np.uint16, "mono16": np.uint16, "32FC1": np.float32}


class Undecodable(Exception):
    """An image that cannot be decoded; the message says why."""


class Unsupported(Undecodable):
    """An image of a kind that is not known, so all of its topic are undecodable."""


def is_depth(picture: Picture) -> bool:
    """Whether a picture says that it holds depth; a grey PNG of 16 bits is taken to."""
    if picture.encoding or "compressedDepth" in picture.format:
        return picture.encoding in ("16UC1", "32FC1") or "compressedDepth" in picture.format
    if picture.format.startswith(("16UC1", "32FC1")):
        return True
    try:
        return _header(picture.data)[1] == "I;16"
    except Undecodable:
        return False


def color(picture: Picture) -> np.ndarray:
    """To BGR, shape (H, W, 3), uint8. Raises Undecodable."""
    if picture.format:
        if "compressedDepth" in picture.format:
            raise Unsupported(f"format {picture.format!r} is depth, not colour")
        return _unpacked(picture.data, cv2.IMREAD_COLOR, picture.format)
    if picture.encoding not in COLORS:
        raise Unsupported(f"colour encoding {picture.encoding!r} is not known, use rgb8 or bgr8")
    channels, conversion = COLORS[picture.encoding]
    pixels = _rows(picture, np.uint16 if picture.encoding == "mono16" else np.uint8, channels)
    if picture.encoding == "mono16":
        pixels = (pixels >> 8).astype(np.uint8)
    return np.ascontiguousarray(pixels) if conversion is None else cv2.cvtColor(pixels, conversion)


def depth(picture: Picture) -> np.ndarray:
    """To metres, shape (H, W), float32, 0 where unknown. Raises Undecodable."""
    if not picture.format:
        if picture.encoding not in DEPTHS:
            raise Unsupported(
                f"depth encoding {picture.encoding!r} is not known, use 16UC1 or 32FC1"
            )
        return _metres(_rows(picture, DEPTHS[picture.encoding], 1))
    if "compressedDepth" not in picture.format:
        if picture.format.startswith("32FC1"):
            raise Unsupported(f"depth format {picture.format!r} is not known, use compressedDepth")
        return _metres(_unpacked(picture.data, cv2.IMREAD_UNCHANGED, picture.format))
    if len(picture.data) <= DEPTH_HEADER.size:
        raise Undecodable("compressedDepth without a picture")
    _, scale, offset = DEPTH_HEADER.unpack_from(picture.data.data)
    body = picture.data[DEPTH_HEADER.size :]
    is_rvl = "rvl" in picture.format.lower()
    packed = rvl(body) if is_rvl else _unpacked(body, cv2.IMREAD_UNCHANGED, picture.format)
    if not picture.format.startswith("32FC1"):
        return _metres(packed)
    with np.errstate(all="ignore"):
        quantised = np.where(packed > 0, scale / (packed - np.float32(offset)), 0)
    return _metres(quantised.astype(np.float32))


def grey(data: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """A grey PNG of this width and height to uint8, shape (H, W). Raises Undecodable."""
    try:
        found, mode = _header(data)
    except Undecodable as error:
        raise Undecodable(f"is not a grey PNG of 8 bits or 1: {error}") from error
    if mode not in ("L", "1") or data[0] == 0xFF:
        raise Undecodable("is not a grey PNG of 8 bits or 1")
    if found != size:
        raise Undecodable("is of {} x {} pixels, not of {} x {}".format(*found, *size))
    return _unpacked(data, cv2.IMREAD_GRAYSCALE, "png")


def size_of(picture: Picture) -> tuple[int, int] | None:
    """Width and height without decoding; None where the header is damaged or not known."""
    if not picture.format:
        return picture.width, picture.height
    data = picture.data
    if "compressedDepth" in picture.format:
        data = data[DEPTH_HEADER.size :]
        if "rvl" in picture.format.lower():
            return RVL_SIZE.unpack_from(data.data) if len(data) >= RVL_SIZE.size else None
    try:
        return _header(data)[0]
    except Undecodable:
        return None


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


def _header(data: np.ndarray) -> tuple[tuple[int, int], str]:
    """Size and Pillow's mode of a JPEG or PNG, by its header alone. Raises Undecodable."""
    try:
        with Image.open(io.BytesIO(data.data), formats=("JPEG", "PNG")) as image:
            return image.size, image.mode
    except Exception as error:  # damaged bytes make Pillow raise anything
        kind = type(error).__name__  # its words hold addresses, which differ from run to run
        raise Undecodable(f"damaged image, or neither JPEG nor PNG ({kind})") from error


def _unpacked(data: np.ndarray, flags: int, kind: str) -> np.ndarray:
    (width, height), _ = _header(data)
    if width * height > LARGEST:
        raise Undecodable(f"an image of {width} x {height} pixels ({kind})")
    if data[0] == 0xFF and b"\xff\xd9" not in data[-4096:].tobytes():
        raise Undecodable("JPEG is cut off")  # OpenCV would fill it up with grey
    if data[0] == 0xFF and data.tobytes().count(b"\xff\xda") > SCANS:
        raise Undecodable(f"JPEG of more than {SCANS} scans")
    if data[0] != 0xFF and not _chunks_fit(data):
        raise Undecodable(f"damaged PNG ({kind})")
    try:
        image = cv2.imdecode(data, flags)
    except cv2.error:
        image = None
    if image is None:
        raise Undecodable(f"damaged image ({kind})")
    return image


def _chunks_fit(data: np.ndarray) -> bool:
    """Whether a PNG's chunks are whole: OpenCV checks no CRC and believes every length."""
    at = 8
    while at + PNG_CHUNK.size <= len(data):
        length, kind = PNG_CHUNK.unpack_from(data.data, at)
        end = at + PNG_CHUNK.size + length
        said = int.from_bytes(data[end : end + 4].tobytes(), "big")
        if end + 4 > len(data) or zlib.crc32(data[at + 4 : end].data) != said:
            return False
        if kind == b"IEND":
            return True
        at = end + 4
    return False


def _rows(picture: Picture, kind: type, channels: int) -> np.ndarray:
    """Pixels of a raw picture without the padding at the ends of its rows."""
    order = np.dtype(kind).newbyteorder(">" if picture.is_bigendian else "<")
    used = picture.width * channels * order.itemsize
    if not 0 < picture.width * picture.height <= LARGEST or picture.step < used:
        raise Undecodable("raw image of another size than it says")
    if len(picture.data) != picture.height * picture.step:
        raise Undecodable(
            f"raw image of {len(picture.data)} bytes, {picture.height} rows of {picture.step}"
            " were said"
        )
    rows = picture.data.reshape(picture.height, picture.step)[:, :used]
    pixels = np.ascontiguousarray(rows).view(order).astype(kind, copy=False)
    return pixels if channels == 1 else pixels.reshape(picture.height, picture.width, channels)


def _metres(depth: np.ndarray) -> np.ndarray:
    """uint16 holds millimetres, floats hold metres."""
    if depth.ndim != 2:
        raise Unsupported("a picture in colour is no depth image")
    if depth.dtype == np.uint16:
        return depth.astype(np.float32) / 1000
    if depth.dtype != np.float32:
        raise Unsupported(f"depth image of {depth.dtype}, use 16 bits (mm) or 32FC1 (m)")
    known = np.isfinite(depth) & (depth > 0)
    return np.where(known, depth, np.float32(0))
