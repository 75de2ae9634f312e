"""Images of every supported encoding, and cameras with distortion."""

from __future__ import annotations

import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from pipeline.recording.images import Camera, Undecodable, color, depth, is_depth

RANDOM = np.random.default_rng(0)
BGR = RANDOM.integers(0, 256, (6, 5, 3)).astype(np.uint8)
DEPTH = RANDOM.uniform(0.3, 2.5, (6, 5)).astype(np.float32)
MILLIMETRES = np.round(DEPTH * 1000).astype(np.uint16)


def raw(encoding: str, pixels: np.ndarray, padding: int = 0) -> SimpleNamespace:
    rows = pixels.reshape(len(pixels), -1).view(np.uint8)
    rows = np.pad(rows, [(0, 0), (0, padding)])
    return SimpleNamespace(
        encoding=encoding,
        height=pixels.shape[0],
        width=pixels.shape[1],
        step=rows.shape[1],
        is_bigendian=0,
        data=rows.ravel(),
    )


def packed(format: str, image: np.ndarray, header: bytes = b"") -> SimpleNamespace:
    _, data = cv2.imencode(".png", image)
    return SimpleNamespace(format=format, data=np.frombuffer(header + data.tobytes(), np.uint8))


@pytest.mark.parametrize("padding", [0, 3])
def test_raw_colors(padding) -> None:
    np.testing.assert_array_equal(color(raw("bgr8", BGR, padding)), BGR)
    np.testing.assert_array_equal(color(raw("rgb8", BGR[..., ::-1].copy(), padding)), BGR)
    mono = color(raw("mono8", BGR[..., 0].copy(), padding))
    np.testing.assert_array_equal(mono, np.repeat(BGR[..., :1], 3, axis=2))
    with pytest.raises(Undecodable, match="bayer"):
        color(raw("bayer_rggb8", BGR[..., 0].copy()))


def test_compressed_color() -> None:
    np.testing.assert_array_equal(color(packed("bgr8; png compressed bgr8", BGR)), BGR)
    with pytest.raises(Undecodable):
        color(SimpleNamespace(format="jpeg", data=np.zeros(0, np.uint8)))


def test_depths_are_metres() -> None:
    np.testing.assert_allclose(depth(raw("16UC1", MILLIMETRES)), DEPTH, atol=6e-4)
    np.testing.assert_array_equal(depth(raw("32FC1", DEPTH)), DEPTH)
    png = packed("16UC1; compressedDepth png", MILLIMETRES, bytes(12))
    np.testing.assert_allclose(depth(png), DEPTH, atol=6e-4)
    unknown = DEPTH.copy()
    unknown[0, 0] = np.nan
    assert depth(raw("32FC1", unknown))[0, 0] == 0


def test_quantised_depth_as_image_transport_writes_it() -> None:
    a, b = 100 * 101.0, 1 - 100 / 10 * 10.1  # A and B of depthQuantZ0 = 100, maximum 10 m
    quantised = np.round(a / DEPTH + b).astype(np.uint16)
    message = packed("32FC1; compressedDepth png", quantised, struct.pack("<iff", 0, a, b))
    np.testing.assert_allclose(depth(message), DEPTH, rtol=2e-4)


def test_rvl_is_refused_by_name() -> None:
    with pytest.raises(Undecodable, match="RVL"):
        depth(SimpleNamespace(format="16UC1; compressedDepth rvl", data=np.zeros(50, np.uint8)))


def test_depth_is_told_from_color() -> None:
    assert is_depth(raw("16UC1", MILLIMETRES)) and not is_depth(raw("rgb8", BGR))
    assert is_depth(SimpleNamespace(format="16UC1; compressedDepth"))
    assert not is_depth(SimpleNamespace(format="rgb8; jpeg compressed bgr8"))


@pytest.mark.parametrize(
    "distortion",
    [[], [0.1, -0.05, 0.001, -0.002, 0.01], [0.3, 0.1, 0.001, -0.001, 0.02, 0.25, 0.08, 0.01]],
)
def test_rays_are_the_inverse_of_projection(distortion) -> None:
    matrix = np.array([[60.0, 0, 31.5], [0, 62.0, 23.5], [0, 0, 1]])
    camera = Camera(64, 48, matrix, np.array(distortion), "camera")
    points = camera.rays().reshape(-1, 3) * RANDOM.uniform(0.5, 2, (64 * 48, 1))
    u, v = np.meshgrid(np.arange(64), np.arange(48))
    expected = np.stack([u, v], -1).reshape(-1, 2)
    np.testing.assert_allclose(camera.project(points), expected, atol=0.05)
