"""Packed pictures: JPEG, PNG and what else OpenCV unpacks, as far as they can be believed."""

from __future__ import annotations

import io
import re
import struct
import zlib
from typing import NamedTuple

import cv2
import numpy as np
from cv2.utils import logging
from PIL import Image

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "JPEG2000", "AVIF")  # of what OpenCV unpacks
KNOWN = "JPEG, PNG, WebP, TIFF, BMP, JPEG 2000 or AVIF"
JPEG = b"\xff\xd8"
MARKER = re.compile(rb"\xff+([^\x00\xd0-\xd7\xff])", re.DOTALL)  # but for those within a scan
BARE = (0x01, 0xD8)  # markers without a length
SCAN, END = 0xDA, 0xD9
SCANS = 100  # of a JPEG, of which each asks to go over all its pixels again
LARGEST = 2**24  # pixels; a damaged size must not ask for more memory than this
PNG_CHUNK = struct.Struct(">I4s")  # length, type
WEBP = re.compile(rb"RIFF....WEBP(VP8[ LX])....", re.DOTALL)


class Undecodable(Exception):
    """An image that cannot be decoded; the message says why."""


class Unsupported(Undecodable):
    """An image of a kind that is not known, so all of its topic are undecodable."""


class Header(NamedTuple):
    """What the first bytes tell: width and height, Pillow's mode and name of the format."""

    size: tuple[int, int]
    mode: str
    format: str


def header(data: np.ndarray) -> Header:
    """Without unpacking. Raises Undecodable."""
    start = data[:40].tobytes()
    if match := WEBP.match(start):  # Pillow would ask for all of its pixels at once
        return Header(_webp_size(match[1], start[match.end() :]), "RGB", "WEBP")
    try:
        with Image.open(io.BytesIO(data.data), formats=FORMATS) as image:
            return Header(image.size, image.mode, str(image.format))
    except Exception as error:  # damaged bytes make Pillow raise anything
        kind = type(error).__name__  # its words hold addresses, which differ from run to run
        raise Undecodable(f"damaged image, or neither {KNOWN} ({kind})") from error


def unpacked(data: np.ndarray, flags: int, kind: str) -> np.ndarray:
    """Pixels as `cv2.imdecode` has them; what follows on the picture's end is passed over.

    Args:
        data: uint8, shape (bytes,).
        flags: OpenCV's.
        kind: What the message says that it is.

    Raises:
        Undecodable: It is damaged, cut off or too large.
    """
    (width, height), _, format = header(data)
    if width * height > LARGEST:
        raise Undecodable(f"an image of {width} x {height} pixels ({kind})")
    if format == "JPEG":
        data = data[: _jpeg_end(data.tobytes())]
    if format == "PNG" and not _chunks_fit(data):
        raise Undecodable(f"damaged PNG ({kind})")
    level = logging.setLogLevel(logging.LOG_LEVEL_SILENT)  # what it would say is said here
    try:
        image = cv2.imdecode(data, flags)
    except cv2.error:
        image = None
    finally:
        logging.setLogLevel(level)
    if image is None:
        raise Undecodable(f"damaged {format} ({kind})")
    return image


def _jpeg_end(data: bytes) -> int:
    """Where a JPEG ends: drivers send their whole buffer, with anything behind it.

    Raises:
        Undecodable: It has no end, and OpenCV would fill it up with grey; or scans without end.
    """
    at, scans = len(JPEG), 0
    while match := MARKER.search(data, at):
        marker, at = match[1][0], match.end()
        if marker == END:
            return at
        if marker in BARE:
            continue
        scans += marker == SCAN
        if scans > SCANS:
            raise Undecodable(f"JPEG of more than {SCANS} scans")
        at += int.from_bytes(data[at : at + 2], "big")
    raise Undecodable("JPEG is cut off")


def _chunks_fit(data: np.ndarray) -> bool:
    """Whether a PNG's chunks are whole: OpenCV checks no CRC and believes every length."""
    at = 8
    while at + PNG_CHUNK.size <= len(data):
        length, kind = PNG_CHUNK.unpack_from(data.data, at)
        end = at + PNG_CHUNK.size + length
        stored = int.from_bytes(data[end : end + 4].tobytes(), "big")
        if end + 4 > len(data) or zlib.crc32(data[at + 4 : end].data) != stored:
            return False
        if kind == b"IEND":
            return True
        at = end + 4
    return False


def _webp_size(kind: bytes, body: bytes) -> tuple[int, int]:
    """Width and height in the first chunk: developers.google.com/speed/webp/docs/riff_container."""
    if len(body) < 10:
        raise Undecodable("WebP is cut off")
    if kind == b"VP8X":
        sides = (int.from_bytes(body[4:7], "little"), int.from_bytes(body[7:10], "little"))
        return sides[0] + 1, sides[1] + 1
    if kind == b"VP8L":
        bits = int.from_bytes(body[1:5], "little")
        return (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    width, height = struct.unpack_from("<HH", body, 6)
    return width & 0x3FFF, height & 0x3FFF
