"""Why the depth pictures show no band where it must be: another unit, or bytes the wrong way round.

The drawn band is two straight lines from the fork's tips to the hand, so the depth along them is
known. If it is found there once the pictures are read another way, that is how they were written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pipeline.recording.geometry import Geometry
from pipeline.recording.input import images
from pipeline.recording.input.reader import Recording
from pipeline.recording.input.readings import Picture
from pipeline.recording.view import Scene

FACTORS = {  # by which what is read is too large, and the unit that was written
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
PICTURES = 12  # of the drawn band that are looked at
PLACES = np.linspace(0.1, 0.8, 40)  # along each of its halves
ASIDE = 0.012  # m by which it may be off the line
NEAR = 0.02  # of the distance, within which what is seen is the band
OFTEN = 0.5  # share of the places at which it must be found


def misread(recording: Recording, geometry: Geometry, scene: Scene) -> str | None:
    """In words, how the depth pictures should have been read; None where nothing tells."""
    times = recording.depth.seconds(scene.signals.origin)
    taut = [k for k, time in enumerate(times) if scene.taut(float(time))]
    taut = taut[:: max(1, len(taut) // PICTURES)]
    shares: dict[str, list[float]] = {}
    for k in taut:
        pixels, depths = _band(recording, geometry, scene, float(times[k]))
        if not len(pixels):
            continue
        reach = int(ASIDE * recording.depth_camera.matrix[0, 0] / np.median(depths)) + 1
        aside = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T
        for name, read in _ways(recording.depth.values[k]).items():
            try:
                picture = read()
            except images.Undecodable:
                continue
            if picture.shape != (recording.depth_camera.height, recording.depth_camera.width):
                continue
            height, width = picture.shape
            around = np.clip(pixels[:, None] + aside, 0, (width - 1, height - 1))
            seen = picture[around[..., 1], around[..., 0]] / depths[:, None]
            for factor in (1.0, *FACTORS):
                found = (np.abs(seen / factor - 1) < NEAR).any(axis=1)
                shares.setdefault(_said(name, factor), []).append(float(found.mean()))
    if not shares:
        return None
    best = max(shares, key=lambda name: np.mean(shares[name]))
    return best if best and np.mean(shares[best]) > OFTEN else None


def _said(name: str, factor: float) -> str:
    if factor == 1.0:
        return name
    unit = (
        f"the depth is {factor:g} times what it must be between fork and hand, as of unit"
        f" {FACTORS[factor]}"
    )
    return f"{name}, and {unit}" if name else unit


def _ways(picture: Picture) -> dict[str, Callable[[], np.ndarray]]:
    """Ways to read a picture, by what is wrong with it; "" as it says itself."""
    ways: dict[str, Callable[[], np.ndarray]] = {"": lambda: images.depth(picture)}
    if picture.encoding:
        other = replace(picture, is_bigendian=not picture.is_bigendian)
        flag = int(picture.is_bigendian)
        said = f"is_bigendian is {flag}, but the depth's bytes are the other way round"
        ways[said] = lambda: images.depth(other)
    return ways


def _band(
    recording: Recording, geometry: Geometry, scene: Scene, time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (P, 2) of the drawn band's two lines, and the depth there [m], (P,)."""
    camera, hand = recording.depth_camera, scene.signals.hand(time)
    lines = scene.tips[:, None] + PLACES[:, None] * (hand - scene.tips)[:, None]
    seen = geometry.camera.inverse().apply(lines.reshape(-1, 3))
    seen = seen[seen[:, 2] > 0]
    pixels = np.round(camera.project(seen)).astype(int)
    inside = np.all((pixels >= 0) & (pixels < (camera.width, camera.height)), axis=1)
    return pixels[inside], seen[inside, 2]
