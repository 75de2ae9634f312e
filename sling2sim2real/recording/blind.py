"""Why no band is seen: depth in another unit or byte order, or a camera_info of other pictures.

How far the hand is from the camera is known. The way of reading by which the pictures say so too is
how they were written.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sling2sim2real.recording.input import images
from sling2sim2real.recording.view import View

LOOKS, LEAST = 15, 3  # pictures that are looked at, and of which the hand must be known
AROUND = 4  # pixels to each side of the hand
FITS = 1.3  # by which factor the hand's depth may be off for what covers it
ALIKE = 0.1  # of it, by which it differs from picture to picture
OFF_CENTER = 0.2  # of a picture's size: a lens is before its middle
UNITS = {  # by which what is read is too large, and the unit that was written
    1000.0: "32FC1 in millimetres",
    100.0: "32FC1 in centimetres",
    10.0: "0.1 mm",
    8.0: "0.125 mm",
    5.0: "0.2 mm",
    4.0: "0.25 mm",
    2.0: "0.5 mm",
    0.256: "1/256 m",
    0.1: "cm",
    0.001: "m",
}
CURE = "publish it as 16UC1 in millimetres or 32FC1 in metres, of the byte order that it says"


def why_no_band(view: View) -> str:
    """What of the camera does not go with what is known of the hand, "" where all does."""
    camera = view.recording.depth_camera
    size = np.array([camera.width, camera.height])
    center = camera.matrix[[0, 1], 2]
    if np.any(np.abs(center / size - 0.5) > OFF_CENTER):
        at, whole = (f"{a:.0f} x {b:.0f}" for a, b in (center, size))
        return (
            f"the depth camera's principal point is at {at} of {whole} pixels: its camera_info is"
            " of another resolution"
        )
    stated_factor, swapped = (_factor(view, other) for other in (False, True))
    if stated_factor == 1.0 or (stated_factor is None and swapped is None):
        return ""
    reasons = []
    if stated_factor is None or swapped == 1.0:
        flag = int(view.recording.depth.values[0].is_bigendian)
        reasons.append(f"is_bigendian is {flag}, but the depth's bytes are the other way round")
        stated_factor = swapped
    if stated_factor is not None and stated_factor != 1.0:
        unit = f", as of unit {UNITS[stated_factor]}" if stated_factor in UNITS else ""
        reasons.append(f"the depth is {stated_factor:g} times what it must be at the hand{unit}")
    return f"{', and '.join(reasons)}: {CURE}"


def _factor(view: View, swapped: bool) -> float | None:
    """Factor by which the hand's depth is too large: 1, one of UNITS, or another.

    None where it differs from picture to picture, or too few show it.

    Args:
        swapped: With the pixels' bytes the other way round than they say.
    """
    seen = np.array([*_hand(view, swapped)])
    if len(seen) < LEAST:
        return None
    factor = float(np.median(seen))
    if np.median(np.abs(seen / factor - 1)) > ALIKE:
        return None
    near = min((1.0, *UNITS), key=lambda unit: abs(np.log(factor / unit)))
    return near if 1 / FITS < factor / near < FITS else float(f"{factor:.2g}")


def _hand(view: View, swapped: bool) -> Iterator[float]:
    """Depth where the hand must be, over what it must be, of pictures in which both are known."""
    camera, place = view.recording.depth_camera, view.geometry.camera.inverse()
    for number in np.linspace(0, len(view) - 1, LOOKS).astype(int):
        hand = place.apply(view.scene.signals.hand(view.times[number])[None])
        if hand[0, 2] <= 0:
            continue
        u, v = np.round(camera.project(hand)[0]).astype(int)
        if not (AROUND <= u < camera.width - AROUND and AROUND <= v < camera.height - AROUND):
            continue
        picture = view.recording.depth.values[view.index[number][0]]
        if swapped and not picture.encoding:
            return  # packed pictures have their own order
        try:
            depth = images.depth(replace(picture, is_bigendian=picture.is_bigendian ^ swapped))
        except images.Undecodable:
            continue
        if depth.shape != (camera.height, camera.width):
            continue
        near = depth[v - AROUND : v + AROUND + 1, u - AROUND : u + AROUND + 1]
        near = near[near > 0]
        if len(near):
            yield float(np.median(near)) / hand[0, 2]
