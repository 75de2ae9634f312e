"""Cameras against the formulas of their distortion models, and calibrations that do not fit."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.camera import Camera, camera_from
from sling2sim2real.recording.messages import read_calibration

K = np.array([[60.0, 0, 31.5], [0, 62.0, 23.5], [0, 0, 1]])
PLUMB_BOB = [0.1, -0.05, 0.001, -0.002, 0.01]
RATIONAL = [0.3, 0.1, 0.001, -0.001, 0.02, 0.25, 0.08, 0.01]
THIN_PRISM = [*RATIONAL, 0.002, -0.001, 0.001, 0.0005]
POINTS = np.random.default_rng(0).uniform([-0.4, -0.3, 0.8], [0.4, 0.3, 1.5], (50, 3))


def info(matrix=K, distortion=(), model="plumb_bob", **more: object) -> SimpleNamespace:
    projection = np.hstack([np.asarray(matrix), np.zeros((3, 1))])
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=2), frame_id="optical"),
        **{
            "width": 64,
            "height": 48,
            "k": list(np.ravel(matrix)),
            "d": list(distortion),
            "p": list(projection.ravel()),
            "distortion_model": model,
            **more,
        },
    )


def camera(message, image="/camera/image", size=(64, 48)) -> Camera:
    return camera_from("/camera/info", read_calibration(message).value, image, size)


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
    result = camera(info(distortion=distortion, model=model))
    expected = distorted(POINTS, distortion[:12])
    np.testing.assert_allclose(result.project(POINTS), expected, atol=1e-9)
    assert_rays_lead_back(result)


def assert_rays_lead_back(model: Camera) -> None:
    points = model.rays().reshape(-1, 3) * np.linspace(0.5, 2, 64 * 48)[:, None]
    u, v = np.meshgrid(np.arange(64), np.arange(48))
    expected = np.stack([u, v], -1).reshape(-1, 2)
    np.testing.assert_allclose(model.project(points), expected, atol=1e-4)


def test_foxglove_and_ros_1_have_capitals() -> None:
    message = SimpleNamespace(
        timestamp=SimpleNamespace(sec=1, nsec=2),
        frame_id="optical",
        width=64,
        height=48,
        K=list(K.ravel()),
        D=PLUMB_BOB,
        P=[],
        R=[],
        distortion_model="plumb_bob",
    )
    reading = read_calibration(message)
    assert (reading.stamp, reading.frame) == (1_000_000_002, "optical")
    assert reading.value.camera.frame == "optical"
    np.testing.assert_array_equal(camera(message).distortion, PLUMB_BOB)


def test_rectified_images_have_the_camera_p() -> None:
    p = [50.0, 0, 30, 0, 0, 50, 20, 0, 0, 0, 1, 0]
    message = info(distortion=PLUMB_BOB, p=p)
    result = camera(message, image="/camera/image_rect_color/compressed")
    np.testing.assert_array_equal(result.matrix, [[50, 0, 30], [0, 50, 20], [0, 0, 1]])
    assert not len(result.distortion)
    assert camera(message, image="/camera/rectified").matrix[0, 0] == 50
    for image in ("/camera/image_raw", "/direct/correct_image"):
        assert camera(message, image=image).matrix[0, 0] == 60


@pytest.mark.parametrize(
    ("message", "size", "words"),
    [
        (info(np.zeros((3, 3))), (64, 48), "not calibrated"),
        (info(np.full((3, 3), np.nan)), (64, 48), "not calibrated"),
        (info(distortion=[0.1] * 4, model="equidistant"), (64, 48), "model 'equidistant'.*rectif"),
        (info(distortion=[0.1] * 6), (64, 48), "with 6 coefficients"),
        (
            info(),
            (32, 24),
            "images of /camera/image are 32 x 24 pixels, /camera/info is of 64 x 48",
        ),
        (info(width=2**31, height=2**31), (64, 48), "2147483648 x 2147483648"),
    ],
)
def test_calibrations_that_do_not_fit(message, size, words) -> None:
    with pytest.raises(UserError, match=words) as caught:
        camera(message, size=size)
    assert "\n" not in str(caught.value)
