"""Pictures of every encoding, cameras of every model; what does not fit says so."""

from __future__ import annotations

import struct
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.camera import Calibration, Camera, camera_from
from sling2sim2real.recording.images import Undecodable, color, depth
from sling2sim2real.recording.messages import Picture
from tests.recording.conftest import of_pictures, whole_of
from validation.recordings.bag import Lens, write_bag
from validation.recordings.small import TRUTH, small_params

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


def test_quantised_depth_as_image_transport_writes_it() -> None:
    """Inverse depth with depth_max 10 m and depth_quantization 100, behind a header."""
    a = 100 * 101.0
    b = 1 - a / 10
    inverse = np.round(a / DEPTH + b).astype(np.uint16)
    inverse[2, 3] = 0
    result = depth(
        packed("32FC1; compressedDepth png", struct.pack("<iff", 0, a, b) + png(inverse))
    )
    np.testing.assert_allclose(result, np.where(inverse > 0, DEPTH, 0), rtol=2e-4)


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
        (depth, raw("16SC1", MILLIMETRES.astype(np.int16)), "'16SC1' is no depth, use 16UC1"),
        (color, raw("mono16", MILLIMETRES), "'mono16' is no known colour, use rgb8"),
        (color, packed("jpeg", b""), "damaged"),
        (color, packed("jpeg", JPEG[:-2]), "cut off"),
        (color, packed("gif", cv2.imencode(".gif", BGR)[1].tobytes()), "neither JPEG"),
        (
            color,  # of 12 GB
            packed("jpeg", JPEG[:SIZE] + struct.pack(">HH", 65500, 65500) + JPEG[SIZE + 4 :]),
            "Bomb",
        ),
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


K = np.array([[60.0, 0, 31.5], [0, 62.0, 23.5], [0, 0, 1]])
PLUMB_BOB = [0.1, -0.05, 0.001, -0.002, 0.01]
RATIONAL = [0.3, 0.1, 0.001, -0.001, 0.02, 0.25, 0.08, 0.01]
THIN_PRISM = [*RATIONAL, 0.002, -0.001, 0.001, 0.0005]
RECTIFIED = np.array([[50.0, 0, 30], [0, 50, 20], [0, 0, 1]])
POINTS = np.random.default_rng(0).uniform([-0.4, -0.3, 0.8], [0.4, 0.3, 1.5], (50, 3))


def camera(
    matrix=K, distortion=(), model="plumb_bob", size=(64, 48), image="/camera/image"
) -> Camera:
    """Of images of 64 x 48 pixels; rectified ones have another matrix."""
    camera = Camera(*size, np.asarray(matrix), np.array(distortion, float), "optical")
    calibration = Calibration(camera, model, RECTIFIED)
    return camera_from("/camera/info", calibration, image, (64, 48))


def distorted(points: np.ndarray, d: list[float]) -> np.ndarray:
    """docs.opencv.org, calib3d: radial (rational), tangential, thin prism."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = [*d, *[0.0] * (12 - len(d))]
    x, y = (points[:, :2] / points[:, 2:]).T
    r = x * x + y * y
    radial = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
    u = x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x) + s1 * r + s2 * r * r
    v = y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y + s3 * r + s4 * r * r
    return np.stack([60 * u + 31.5, 62 * v + 23.5], axis=1)


@pytest.mark.parametrize(
    ("model", "distortion"),
    [
        ("plumb_bob", []),
        ("plumb_bob", [0.0] * 5),
        ("", PLUMB_BOB[:4]),
        ("plumb_bob", PLUMB_BOB),
        ("plumb_bob", RATIONAL),
        ("rational_polynomial", RATIONAL),
        ("rational_polynomial", THIN_PRISM),
        ("rational_polynomial", [*THIN_PRISM, 0.0, 0.0]),
    ],
)
def test_pinholes(model, distortion) -> None:
    result = camera(distortion=distortion, model=model)
    expected = distorted(POINTS, distortion[:12])
    np.testing.assert_allclose(result.project(POINTS), expected, atol=1e-9)
    assert_rays_lead_back(result)


def assert_rays_lead_back(model: Camera) -> None:
    points = model.rays().reshape(-1, 3) * np.linspace(0.5, 2, 64 * 48)[:, None]
    u, v = np.meshgrid(np.arange(64), np.arange(48))
    expected = np.stack([u, v], -1).reshape(-1, 2)
    np.testing.assert_allclose(model.project(points), expected, atol=1e-4)


@pytest.mark.parametrize(
    ("image", "focal"),
    [
        ("/camera/image_rect_color/compressed", 50),
        ("/camera/rectified", 50),
        ("/camera/image_raw", 60),
        ("/direct/correct_image", 60),
    ],
)
def test_rectified_images_have_the_camera_p(image, focal) -> None:
    result = camera(distortion=PLUMB_BOB, image=image)
    np.testing.assert_array_equal(result.matrix, RECTIFIED if focal == 50 else K)
    assert len(result.distortion) == (0 if focal == 50 else 5)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"matrix": np.zeros((3, 3))}, "not calibrated"),
        ({"matrix": np.full((3, 3), np.nan)}, "not calibrated"),
        ({"distortion": [0.1] * 4, "model": "equidistant"}, "model 'equidistant'.*rectif"),
        ({"distortion": [0.1] * 6}, "with 6 coefficients"),
        ({"size": (32, 24)}, "/camera/image are 64 x 48 pixels, /camera/info is of 32 x 24"),
        ({"size": (2**31, 2**31)}, "2147483648 x 2147483648"),
    ],
)
def test_calibrations_that_do_not_fit(given, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        camera(**given)
    assert "\n" not in str(caught.value)


LENS = Lens(size=(160, 120), focal=125.0, fps=8)
PARAMS = small_params()


def looked_at(folder, change):
    """What becomes of a small recording with these pictures."""
    path = folder / "my.mcap"
    write_bag(path, TRUTH, rate=200, pose_rate=50, lens=LENS, change=change)
    return whole_of(path, PARAMS)


def of_color(edit):
    """A `change` that edits the bytes of the colour pictures, by number."""
    numbers = iter(range(10_000))

    def change(kind: str, stamp: int, message):
        if kind == "color":
            message.data = edit(next(numbers), message.data)
        return message

    return change


def test_colour_that_cannot_be_decoded_stops_before_an_episode(tmp_path) -> None:
    for edit, reason in (
        (lambda k, data: data[: len(data) // 2] + bytes(3000), "JPEG is cut off"),
        (lambda k, data: b"no picture", "damaged image"),
    ):
        with pytest.raises(UserError) as caught:
            looked_at(tmp_path, of_color(edit))
        assert "its pictures cannot be decoded: " in str(caught.value) and reason in str(
            caught.value
        )


def test_what_can_be_decoded_is_read_and_the_rest_is_counted_as_colour(tmp_path) -> None:
    padded = looked_at(tmp_path, of_color(lambda k, data: data + bytes(3000)))
    assert padded.clouds.damaged == padded.clouds.damaged_colors == 0
    some = looked_at(tmp_path, of_color(lambda k, data: data[: len(data) // (1 + (k % 4 == 0))]))
    output = [finding.what for finding in of_pictures(some) if finding.about == "damaged"]
    assert output == [f"{some.clouds.damaged_colors} colour pictures cannot be decoded"]
    assert len(some.clouds.points) + some.clouds.damaged == len(padded.clouds.points)
