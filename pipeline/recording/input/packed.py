"""Packed pictures: JPEG, PNG and what else OpenCV unpacks, as far as they can be believed."""

from __future__ import annotations

import io
import re
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
END = 0xD9
LARGEST = 2**24  # pixels; a damaged size must not ask for more memory than this


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
    if format == "PNG":
        _expect_whole(data, kind)
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
        Undecodable: It has no end, and OpenCV would fill it up with grey.
    """
    at = len(JPEG)
    while match := MARKER.search(data, at):
        marker, at = match[1][0], match.end()
        if marker == END:
            return at
        if marker in BARE:
            continue
        at += int.from_bytes(data[at : at + 2], "big")
    raise Undecodable("JPEG is cut off")


def _expect_whole(data: np.ndarray, kind: str) -> None:
    """A PNG's chunks and their checksums, which OpenCV does not look at. Raises Undecodable."""
    try:
        with Image.open(io.BytesIO(data.data), formats=("PNG",)) as image:
            image.verify()
    except Exception as error:  # damaged bytes make Pillow raise anything
        raise Undecodable(f"damaged PNG ({kind})") from error
