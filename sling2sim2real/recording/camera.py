"""Cameras: intrinsics of CameraInfo or foxglove.CameraCalibration, and what a pixel looks along."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import cv2
import numpy as np

from sling2sim2real.base.errors import UserError

PINHOLE = ("", "plumb_bob", "rational_polynomial")
RECTIFIED = re.compile("(^|[/_])rect(ified)?([/_]|$)")  # as image_proc names topics
COUNTS = (4, 5, 8, 12, 14)  # of coefficients that OpenCV's pinhole model takes
UNDISTORT = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 40, 1e-9)


@dataclass(frozen=True)
class Camera:
    """Intrinsics: a pinhole with OpenCV's distortion.

    Attributes:
        width, height: Pixels.
        matrix: Shape (3, 3).
        distortion: 0, 4, 5, 8, 12 or 14 coefficients, in OpenCV's order.
        frame: The optical frame.
    """

    width: int
    height: int
    matrix: np.ndarray
    distortion: np.ndarray
    frame: str

    def rays(self) -> np.ndarray:
        """What each pixel looks along, scaled to z = 1, shape (H, W, 3)."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        pixels = np.stack([u, v], axis=-1).reshape(-1, 1, 2).astype(np.float64)
        rays = cv2.undistortPoints(
            pixels, self.matrix, self.distortion, None, None, None, UNDISTORT
        )
        rays = cv2.convertPointsToHomogeneous(rays)
        return rays.reshape(self.height, self.width, 3)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (u, v), shape (N, 2), of points in the camera's frame, shape (N, 3), z > 0."""
        if not len(points):
            return np.zeros((0, 2))
        points = np.asarray(points, np.float64).reshape(-1, 1, 3)
        still = np.zeros(3)
        pixels, _ = cv2.projectPoints(points, still, still, self.matrix, self.distortion)
        return pixels.reshape(-1, 2)

    def window(self, low: np.ndarray, high: np.ndarray) -> tuple[slice, slice]:
        """Rows and columns of the picture between two pixels (u, v)."""
        size = np.array([self.width, self.height])
        first, last = (np.clip(pixel, 0, size).astype(int) for pixel in (low, high))
        return slice(first[1], last[1]), slice(first[0], last[0])


@dataclass(frozen=True)
class Calibration:
    """What a CameraInfo says, not yet checked.

    Attributes:
        camera: Of the whole sensor.
        model: Name of the distortion model.
        rectified: The camera matrix of rectified images, shape (3, 3).
    """

    camera: Camera
    model: str
    rectified: np.ndarray


def camera_from(topic: str, calibration: Calibration, image: str, size: tuple[int, int]) -> Camera:
    """The camera that took these images.

    Args:
        topic: Of the calibration.
        calibration: As it was read there.
        image: Topic of the images. The camera of rectified ones is P, without distortion.
        size: Width and height of the images.

    Raises:
        UserError: where the camera is not calibrated, its model is not known, or its size is not
            that of the images.
    """
    camera, model = calibration.camera, calibration.model.lower()
    numbers = (*camera.matrix.flat, *camera.distortion, *calibration.rectified.flat)
    if min(camera.matrix[0, 0], camera.matrix[1, 1]) <= 0 or not np.isfinite(numbers).all():
        raise UserError(f"{topic} is not calibrated (focal length 0, or no numbers), calibrate it")
    if size != (camera.width, camera.height):
        raise UserError(
            f"images of {image} are {size[0]} x {size[1]} pixels, {topic} is of"
            f" {camera.width} x {camera.height}: publish the camera info of the images' own size"
        )
    if RECTIFIED.search(image) and calibration.rectified[0, 0] > 0:
        camera = replace(camera, matrix=calibration.rectified, distortion=np.zeros(0))
    if not camera.distortion.any():
        camera = replace(camera, distortion=np.zeros(0))
    count = len(camera.distortion)
    if count and (model not in PINHOLE or count not in COUNTS):
        raise UserError(
            f"{topic} has distortion model {calibration.model!r} with {count} coefficients: publish"
            " plumb_bob (5) or rational_polynomial (8), or rectified images (of a fisheye)"
        )
    return camera
