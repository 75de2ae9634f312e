"""Why no band is seen: depth in another unit, intrinsics of another picture, or extrinsics."""

from __future__ import annotations

import numpy as np

from pipeline.recording.view import View

LOOKS = 15  # pictures
AROUND = 4  # pixels to each side of the hand
FITS = 1.3  # by which factor the hand's depth may be off for what covers it
ALIKE = 0.1  # of it, by which it differs from picture to picture
FACTORS = np.array([0.001, 0.01, 0.1, 0.2, 0.25, 0.5, 2.0, 4.0, 5.0, 10.0, 100.0, 1000.0])
OFF_CENTER = 0.2  # of a picture's size: a lens is before its middle


def why_no_band(view: View) -> str:
    """What of the camera does not go with what is known of hand and fork, "" where all does."""
    camera = view.recording.depth_camera
    size = np.array([camera.width, camera.height])
    center = camera.matrix[[0, 1], 2]
    if np.any(np.abs(center / size - 0.5) > OFF_CENTER):
        at, whole = (f"{a:.0f} x {b:.0f}" for a, b in (center, size))
        return (
            f"the depth camera's principal point is at {at} of {whole} pixels: its camera_info is"
            " of another resolution"
        )
    seen = _depth_of_hand(view)
    if len(seen) < 3:
        return ""
    factor = float(np.median(seen))
    if 1 / FITS < factor < FITS or np.median(np.abs(seen / factor - 1)) > ALIKE:
        return ""
    near = FACTORS[np.argmin(np.abs(np.log(FACTORS / factor)))]
    said = f"{near:g}" if abs(np.log(factor / near)) < np.log(FITS) else f"{factor:.2g}"
    return (
        f"the hand is {said} times as far from the camera in the depth pictures as by its pose:"
        " their unit is another than millimetres (16UC1) or metres (32FC1)"
    )


def _depth_of_hand(view: View) -> np.ndarray:
    """Depth where the hand must be, over what it must be, of pictures in which both are known."""
    camera, place = view.recording.depth_camera, view.geometry.camera.inverse()
    found = []
    for number in np.linspace(0, len(view) - 1, LOOKS).astype(int):
        depth = view.depth(int(number))
        hand = place.apply(view.scene.signals.hand(view.times[number])[None])
        if depth is None or hand[0, 2] <= 0:
            continue
        u, v = np.round(camera.project(hand)[0]).astype(int)
        if not (AROUND <= u < camera.width - AROUND and AROUND <= v < camera.height - AROUND):
            continue
        near = depth[v - AROUND : v + AROUND + 1, u - AROUND : u + AROUND + 1]
        near = near[near > 0]
        if len(near):
            found.append(float(np.median(near)) / hand[0, 2])
    return np.array(found)
