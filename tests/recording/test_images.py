"""Pictures of every supported encoding, written by formulas, OpenCV and Pillow."""

from __future__ import annotations

import io
import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from PIL import Image

from sling2sim2real.recording.images import (
    Undecodable,
    Unsupported,
    color,
    depth,
    is_depth,
    size_of,
)
from sling2sim2real.recording.messages import Picture

RANDOM = np.random.default_rng(0)
BGR = RANDOM.integers(0, 256, (6, 5, 3)).astype(np.uint8)
DEPTH = RANDOM.uniform(0.3, 2.5, (6, 5)).astype(np.float32)
MILLIMETRES = np.round(DEPTH * 1000).astype(np.uint16)


def raw(encoding: str, pixels: np.ndarray, padding: int = 0, swapped: bool = False) -> Picture:
    kind = pixels.dtype.newbyteorder(">" if swapped else "<")
    rows = [row.astype(kind).tobytes() + b"\xaa" * padding for row in pixels]
    data = np.frombuffer(b"".join(rows), np.uint8)
    return Picture(encoding, "", data, *pixels.shape[:2], len(rows[0]), swapped)


def packed(format: str, data: bytes) -> Picture:
    return Picture("", format, np.frombuffer(data, np.uint8))


def png(image: np.ndarray) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


@st.composite
def arrays(draw, kind, channels: int = 1):
    height, width = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = (height, width, channels) if channels > 1 else (height, width)
    if np.issubdtype(kind, np.floating):
        return random.uniform(0.1, 5, shape).astype(kind)
    return random.integers(0, np.iinfo(kind).max + 1, shape).astype(kind)


@given(arrays(np.uint8, 3), st.integers(0, 7))
def test_raw_colors(bgr, padding) -> None:
    alpha = np.full_like(bgr[..., :1], 7)
    np.testing.assert_array_equal(color(raw("bgr8", bgr, padding)), bgr)
    np.testing.assert_array_equal(color(raw("8UC3", bgr, padding)), bgr)
    np.testing.assert_array_equal(color(raw("rgb8", bgr[..., ::-1], padding)), bgr)
    bgra = np.concatenate([bgr, alpha], axis=-1)
    np.testing.assert_array_equal(color(raw("bgra8", bgra, padding)), bgr)
    rgba = np.concatenate([bgr[..., ::-1], alpha], axis=-1)
    np.testing.assert_array_equal(color(raw("rgba8", rgba, padding)), bgr)
    gray = np.repeat(bgr[..., :1], 3, axis=2)
    np.testing.assert_array_equal(color(raw("mono8", bgr[..., 0], padding)), gray)


@given(arrays(np.uint16), st.integers(0, 7), st.booleans())
def test_raw_sixteen_bits(pixels, padding, swapped) -> None:
    metres = (pixels / 1000).astype(np.float32)
    np.testing.assert_allclose(depth(raw("16UC1", pixels, padding, swapped)), metres, rtol=1e-6)
    gray = np.repeat((pixels // 256).astype(np.uint8)[..., None], 3, axis=2)
    np.testing.assert_array_equal(color(raw("mono16", pixels, padding, swapped)), gray)


@given(arrays(np.float32), st.integers(0, 7), st.booleans())
def test_raw_metres(pixels, padding, swapped) -> None:
    np.testing.assert_array_equal(depth(raw("32FC1", pixels, padding, swapped)), pixels)


def test_unknown_depth_is_zero() -> None:
    unknown = DEPTH.copy()
    unknown[0] = [np.nan, np.inf, -np.inf, -1, 0]
    result = depth(raw("32FC1", unknown))
    assert not result[0].any()
    np.testing.assert_array_equal(result[1:], DEPTH[1:])


def test_packed_colors_of_another_library() -> None:
    rgb = Image.fromarray(np.ascontiguousarray(BGR[..., ::-1]))
    for format in ("bgr8; png compressed bgr8", "png", "unnamed"):
        with io.BytesIO() as file:
            rgb.save(file, "PNG")
            np.testing.assert_array_equal(color(packed(format, file.getvalue())), BGR)
    smooth = np.full((32, 48, 3), (200, 120, 40), np.uint8)
    with io.BytesIO() as file:
        Image.fromarray(smooth).save(file, "JPEG", quality=95)
        picture = packed("rgb8; jpeg compressed bgr8", file.getvalue())
    np.testing.assert_allclose(color(picture), smooth[..., ::-1], atol=3)
    assert size_of(picture) == (48, 32)


def test_packed_depths() -> None:
    metres = (MILLIMETRES / 1000).astype(np.float32)
    for picture in (
        packed("16UC1; compressedDepth png", bytes(12) + png(MILLIMETRES)),
        packed("16UC1; compressedDepth", bytes(12) + png(MILLIMETRES)),
        packed("16UC1; png compressed", png(MILLIMETRES)),
        packed("png", png(MILLIMETRES)),
    ):
        assert is_depth(picture) and size_of(picture) == (5, 6)
        np.testing.assert_allclose(depth(picture), metres, rtol=1e-6)


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
    frame = np.full((24, 32), 900, np.uint16)
    jpeg = cv2.imencode(".jpg", np.full((24, 32, 3), 90, np.uint8))[1].tobytes()
    for read, format, content in (
        (depth, "16UC1; compressedDepth png", bytes(12) + png(frame)),
        (depth, "32FC1; compressedDepth png", bytes(12) + png(frame)),
        (color, "jpeg", jpeg),
    ):
        data = np.frombuffer(content, np.uint8).copy()
        data[random.integers(len(data), size=2)] = random.integers(256, size=2)
        data = data[: random.integers(len(data) + 1)] if seed % 2 else data
        try:
            result = read(Picture("", format, data))
        except Undecodable as error:
            assert "\n" not in str(error)
        else:
            assert result.ndim in (2, 3)


def test_what_a_whole_topic_cannot_be_is_told_from_damage() -> None:
    for read, picture in (
        (color, raw("bayer_rggb8", BGR[..., 0])),
        (color, packed("16UC1; compressedDepth png", bytes(12) + png(MILLIMETRES))),
        (depth, raw("rgb8", BGR)),
        (depth, packed("32FC1; png compressed", png(MILLIMETRES))),
        (depth, packed("16UC1; compressedDepth png", bytes(12) + png(BGR[..., 0]))),
        (depth, packed("png", png(BGR))),  # in colour
        (depth, packed("16UC1; compressedDepth rvl", bytes(99))),
    ):
        with pytest.raises(Unsupported):
            read(picture)
    jpeg = cv2.imencode(".jpg", np.full((64, 64, 3), 90, np.uint8))[1].tobytes()
    place = jpeg.index(b"\xff\xc0") + 5
    bomb = jpeg[:place] + struct.pack(">HH", 65500, 65500) + jpeg[place + 4 :]  # of 12 GB
    gif = cv2.imencode(".gif", BGR)[1].tobytes()
    whole = raw("rgb8", BGR)
    for read, picture in (
        (color, packed("jpeg", b"")),
        (color, packed("jpeg", jpeg[: len(jpeg) // 2])),
        (color, packed("gif", gif)),
        (color, packed("jpeg", bomb)),
        (depth, packed("16UC1; compressedDepth png", b"short")),
        (color, Picture("rgb8", "", whole.data[:-1], 6, 5, 15)),
        (color, Picture("rgb8", "", whole.data, 6, 5, 14)),
        (color, Picture("rgb8", "", whole.data, 2**31, 2**31, 2**33)),
        (color, Picture("rgb8", "", whole.data, 0, 5, 15)),
    ):
        with pytest.raises(Undecodable) as caught:
            read(picture)
        assert not isinstance(caught.value, Unsupported)


def test_depth_is_told_from_color() -> None:
    assert is_depth(raw("16UC1", MILLIMETRES)) and is_depth(raw("32FC1", DEPTH))
    assert not is_depth(raw("rgb8", BGR)) and not is_depth(raw("mono16", MILLIMETRES))
    assert is_depth(packed("16UC1; compressedDepth", b""))
    assert not is_depth(packed("rgb8; jpeg compressed bgr8", b""))
    assert not is_depth(packed("png", png(BGR[..., 0])))


SMOOTH = np.full((96, 64, 3), (200, 120, 40), np.uint8)


@pytest.mark.parametrize("kind", [".webp", ".tiff", ".bmp", ".jp2", ".avif"])
def test_what_else_is_unpacked(kind) -> None:
    data = cv2.imencode(kind, SMOOTH)[1].tobytes()
    picture = packed(kind[1:], data)
    assert size_of(picture) == (64, 96) and not is_depth(picture)
    np.testing.assert_allclose(color(picture).astype(int), SMOOTH, atol=6)
    for cut in (data[: len(data) // 2], data[:30]):
        with pytest.raises(Undecodable):
            color(packed(kind[1:], cut))


def test_depth_in_tiff() -> None:
    for pixels in (MILLIMETRES, DEPTH):
        picture = packed("tiff", cv2.imencode(".tiff", pixels)[1].tobytes())
        metres = pixels if pixels.dtype == np.float32 else pixels / 1000
        np.testing.assert_allclose(depth(picture), metres, rtol=1e-6)


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


def test_depth_of_other_encodings_and_without_what_drivers_leave_out() -> None:
    signed = MILLIMETRES.astype(np.int16)
    signed[0, 0] = -1
    result = depth(raw("16SC1", signed))
    assert result[0, 0] == 0 and result[1, 1] == np.float32(MILLIMETRES[1, 1] / 1000)
    np.testing.assert_allclose(depth(raw("64FC1", DEPTH.astype(float))), DEPTH)
    assert is_depth(raw("16SC1", signed)) and is_depth(raw("64FC1", DEPTH.astype(float)))
    bare = packed("16UC1; compressedDepth", png(MILLIMETRES))  # no header
    assert size_of(bare) == (5, 6)
    np.testing.assert_allclose(depth(bare), MILLIMETRES / 1000, rtol=1e-6)
    with pytest.raises(Unsupported, match="without the header of 12 bytes"):
        depth(packed("32FC1; compressedDepth png", png(MILLIMETRES)))
    whole = raw("16UC1", MILLIMETRES)
    for step in (0, 5):  # in pixels
        np.testing.assert_array_equal(depth(replace(whole, step=step)), depth(whole))
    with pytest.raises(Undecodable, match="step 7: a row of 5 pixels of 16UC1 takes 10 bytes"):
        depth(replace(whole, step=7))
    with pytest.raises(Undecodable, match="raw image of 0 x 6 pixels"):
        depth(replace(whole, width=0))
    with pytest.raises(Unsupported, match="'8UC1' is not known, use 16UC1"):
        depth(raw("8UC1", MILLIMETRES.astype(np.uint8)))
