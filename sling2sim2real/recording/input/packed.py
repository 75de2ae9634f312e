"""Packed pictures: JPEG, PNG and what else OpenCV unpacks, as far as they can be believed."""

from __future__ import annotations

import io
from typing import NamedTuple

import cv2
import numpy as np
from cv2.utils import logging
from PIL import Image

FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "JPEG2000", "AVIF")  # of what OpenCV unpacks
KNOWN = "JPEG, PNG, WebP, TIFF, BMP, JPEG 2000 or AVIF"
JPEG_END = b"\xff\xd9"  # behind it is what a driver sends of its buffer
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
    if format == "JPEG" and JPEG_END not in data.tobytes():  # OpenCV may fill it up with grey
        raise Undecodable(f"JPEG is cut off ({kind})")
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


def _expect_whole(data: np.ndarray, kind: str) -> None:
    """A PNG's chunks and their checksums, which OpenCV does not look at. Raises Undecodable."""
    try:
        with Image.open(io.BytesIO(data.data), formats=("PNG",)) as image:
            image.verify()
    except Exception as error:  # damaged bytes make Pillow raise anything
        raise Undecodable(f"damaged PNG ({kind})") from error
