"""Pictures of every supported encoding, written by formulas, OpenCV and Pillow."""

from __future__ import annotations

import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sling2sim2real.recording.images import Undecodable, color, depth
from sling2sim2real.recording.messages import Picture

RANDOM = np.random.default_rng(0)
BGR = RANDOM.integers(0, 256, (6, 5, 3)).astype(np.uint8)
DEPTH = RANDOM.uniform(0.3, 2.5, (6, 5)).astype(np.float32)
MILLIMETRES = np.round(DEPTH * 1000).astype(np.uint16)
SMOOTH = np.full((96, 64, 3), (200, 120, 40), np.uint8)


def raw(encoding: str, pixels: np.ndarray, padding: int = 0, swapped: bool = False) -> Picture:
    kind = pixels.dtype.newbyteorder(">" if swapped else "<")
    rows = [row.astype(kind).tobytes() + b"\xaa" * padding for row in pixels]
    data = np.frombuffer(b"".join(rows), np.uint8)
    return Picture(encoding, "", data, *pixels.shape[:2], len(rows[0]), swapped)


def packed(format: str, data: bytes) -> Picture:
    return Picture("", format, np.frombuffer(data, np.uint8))


def png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


@pytest.mark.parametrize("padding", [0, 7])
def test_raw_pictures(padding) -> None:
    alpha, grey = np.full_like(BGR[..., :1], 7), np.repeat(BGR[..., :1], 3, axis=2)
    for encoding, pixels, wanted in (
        ("bgr8", BGR, BGR),
        ("rgb8", BGR[..., ::-1], BGR),
        ("bgra8", np.concatenate([BGR, alpha], axis=-1), BGR),
        ("rgba8", np.concatenate([BGR[..., ::-1], alpha], axis=-1), BGR),
        ("mono8", BGR[..., 0], grey),
    ):
        np.testing.assert_array_equal(color(raw(encoding, pixels, padding)), wanted)
    for swapped in (False, True):
        millimetres = depth(raw("16UC1", MILLIMETRES, padding, swapped))
        np.testing.assert_allclose(millimetres, MILLIMETRES / 1000, rtol=1e-6)
        np.testing.assert_array_equal(depth(raw("32FC1", DEPTH, padding, swapped)), DEPTH)


def test_unknown_depth_is_zero() -> None:
    unknown = DEPTH.copy()
    unknown[0] = [np.nan, np.inf, -np.inf, -1, 0]
    result = depth(raw("32FC1", unknown))
    assert not result[0].any()
    np.testing.assert_array_equal(result[1:], DEPTH[1:])


@pytest.mark.parametrize("kind", [".png", ".jpg", ".webp", ".tiff", ".bmp", ".jp2", ".avif"])
def test_packed_colors(kind) -> None:
    """By OpenCV; some formats only nearly."""
    data = cv2.imencode(kind, SMOOTH)[1].tobytes()
    for format in (kind[1:], f"rgb8; {kind[1:]} compressed bgr8", "unnamed"):
        picture = packed(format, data)
        np.testing.assert_allclose(color(picture).astype(int), SMOOTH, atol=6)
    for cut in (data[: len(data) // 2], data[:30]):
        with pytest.raises(Undecodable):
            color(packed(kind[1:], cut))


@pytest.mark.parametrize(
    "picture",
    [
        packed("16UC1; compressedDepth png", bytes(12) + png(MILLIMETRES)),
        packed("16UC1; compressedDepth", bytes(12) + png(MILLIMETRES)),
        packed("16UC1; compressedDepth", png(MILLIMETRES)),  # without a header
        packed("16UC1; png compressed", png(MILLIMETRES)),
        packed("png", png(MILLIMETRES)),
        packed("tiff", cv2.imencode(".tiff", MILLIMETRES)[1].tobytes()),
    ],
)
def test_packed_depths(picture) -> None:
    np.testing.assert_allclose(depth(picture), MILLIMETRES / 1000, rtol=1e-6)


def quantised(metres: np.ndarray) -> tuple[bytes, np.ndarray]:
    """Header and inverse depth with depth_max 10 m, depth_quantization 100 (image_transport)."""
    a = 100 * 101.0
    b = 1 - a / 10
    return struct.pack("<iff", 0, a, b), np.where(metres > 0, np.round(a / metres + b), 0)


def test_quantised_depth_as_image_transport_writes_it() -> None:
    metres = DEPTH.copy()
    metres[2, 3] = 0
    header, inverse = quantised(np.where(metres > 0, metres, np.inf))
    inverse[2, 3] = 0
    inverse = inverse.astype(np.uint16)
    result = depth(packed("32FC1; compressedDepth png", header + png(inverse)))
    np.testing.assert_allclose(result, metres, rtol=2e-4)


@given(st.integers(0, 2**32 - 1))
def test_mutated_pictures_are_pictures_or_undecodable(seed) -> None:
    random = np.random.default_rng(seed)
    packed_depth = bytes(12) + png(np.full((24, 32), 900, np.uint16))
    for read, format, content in (
        (depth, "16UC1; compressedDepth png", packed_depth),
        (depth, "32FC1; compressedDepth png", packed_depth),
        (color, "jpeg", JPEG),
    ):
        data = np.frombuffer(content, np.uint8).copy()
        data[random.integers(len(data), size=2)] = random.integers(256, size=2)
        data = data[: random.integers(len(data) + 1)] if seed % 2 else data
        try:
            assert read(Picture("", format, data)).ndim in (2, 3)
        except Undecodable as error:
            assert "\n" not in str(error)


JPEG = cv2.imencode(".jpg", np.full((64, 64, 3), 90, np.uint8))[1].tobytes()
SIZE = JPEG.index(b"\xff\xc0") + 5
WHOLE = raw("rgb8", BGR)


@pytest.mark.parametrize(
    ("read", "picture", "words"),
    [
        (color, raw("bayer_rggb8", BGR[..., 0]), "'bayer_rggb8'"),
        (color, packed("16UC1; compressedDepth png", bytes(12) + png(MILLIMETRES)), "is depth"),
        (depth, WHOLE, "'rgb8'"),
        (depth, packed("32FC1; png compressed", png(MILLIMETRES)), "header of 12 bytes"),
        (color, packed("png", png(MILLIMETRES)), "is depth, not colour"),
        (depth, packed("32FC1; compressedDepth png", png(MILLIMETRES)), "header of 12 bytes"),
        (depth, packed("16UC1; compressedDepth png", bytes(12) + png(BGR[..., 0])), "uint8"),
        (depth, packed("png", png(BGR)), "or in colour"),
        (depth, packed("16UC1; compressedDepth rvl", bytes(99)), "rvl: damaged image, or neither"),
        (depth, raw("8UC1", BGR[..., 0]), "'8UC1' is no depth, use 16UC1"),
        (depth, raw("16SC1", MILLIMETRES.astype(np.int16)), "'16SC1' is no depth, use 16UC1"),
        (depth, raw("64FC1", DEPTH.astype(float)), "'64FC1' is no depth, use 16UC1"),
        (color, raw("mono16", MILLIMETRES), "'mono16' is no known colour, use rgb8"),
        (color, packed("jpeg", b""), "damaged"),
        (color, packed("jpeg", JPEG[:-2]), "cut off"),
        (color, packed("gif", cv2.imencode(".gif", BGR)[1].tobytes()), "neither JPEG"),
        (
            color,  # of 12 GB
            packed("jpeg", JPEG[:SIZE] + struct.pack(">HH", 65500, 65500) + JPEG[SIZE + 4 :]),
            "Bomb",
        ),
        (depth, packed("16UC1; compressedDepth png", b"short"), "damaged"),
        (color, replace(WHOLE, content=WHOLE.data[:-1]), "6 rows of 15 bytes, in 89"),
        (color, replace(WHOLE, step=14), "5 x 6 pixels of rgb8 cannot be 6 rows of 14 bytes"),
        (color, replace(WHOLE, height=2**31, width=2**31, step=2**33), "2147483648 x"),
        (color, replace(WHOLE, height=0), "5 x 0 pixels"),
    ],
)
def test_what_cannot_be_decoded_says_why(read, picture, words) -> None:
    with pytest.raises(Undecodable, match=words):
        read(picture)


@pytest.mark.parametrize("step", [0, 5])
def test_a_step_that_is_missing_or_in_pixels(step) -> None:
    whole = raw("16UC1", MILLIMETRES)
    np.testing.assert_array_equal(depth(replace(whole, step=step)), depth(whole))


@given(st.binary(max_size=6000), st.booleans())
@example(bytes(5000), False)
@example(b"\xff\xd9" * 9, True)
@example(b"\xff\xd8\xff\xe0" * 50, False)
def test_what_follows_on_a_jpeg_does_not_matter(behind, progressive) -> None:
    flags = [cv2.IMWRITE_JPEG_PROGRESSIVE, int(progressive), cv2.IMWRITE_JPEG_RST_INTERVAL, 1]
    data = cv2.imencode(".jpg", BGR, flags)[1].tobytes()
    wanted = color(packed("jpeg", data))
    np.testing.assert_array_equal(color(packed("jpeg", data + behind)), wanted)
    with pytest.raises(Undecodable, match="cut off"):
        color(packed("jpeg", data[: len(data) * 3 // 4] + bytes(5000)))
