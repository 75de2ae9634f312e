"""Camera pictures cut to where the band is, larger, with the simulated band drawn into them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.simulated import AROUND, Simulated

SIMULATED = "#e0007a"  # of the simulated band: seen on rubber of any colour, by any eye
MARGIN = 0.14  # of the cut, around the band
STEPS = 60  # moments that must lie in the cut
SHIFT = 4  # bits below a pixel in which OpenCV takes places
WIDTH, GLOW, LIGHT = 2, 2, 0.5  # pixels; of a light line, wider by GLOW, that sets it off


def bgr(color: str) -> tuple[int, int, int]:
    """Blue, green and red of #rrggbb."""
    blue, green, red = (int(color[place : place + 2], 16) for place in (5, 3, 1))
    return blue, green, red


@dataclass(frozen=True)
class CameraView:
    """A cut of the camera's pictures.

    Attributes:
        corner: Its upper left pixel (u, v).
        scale: Pixels drawn for one of the picture.
        size: Width and height as drawn.
    """

    pictures: Pictures
    corner: np.ndarray
    scale: float
    size: tuple[int, int]

    @classmethod
    def of(
        cls,
        pictures: Pictures,
        simulated: Simulated,
        size: tuple[int, int],
        begin: float | None = None,
    ) -> CameraView:
        """The view of `size` that holds the simulated band around its release.

        It holds the band from `begin` [s] on, where that is given.
        """
        release = simulated.release
        times = np.linspace(release + AROUND[0], release + AROUND[1], STEPS)
        times = times if begin is None else np.append(times, np.linspace(begin, release, STEPS))
        seen = pictures.project(np.concatenate([simulated.line(time) for time in times]))
        low, high = np.nanmin(seen, axis=0), np.nanmax(seen, axis=0)
        whole = np.array([pictures.camera.width, pictures.camera.height], float)
        span = (high - low) * (1 + 2 * MARGIN)
        across = max(span[0], span[1] * size[0] / size[1])
        across = min(across, whole[0], whole[1] * size[0] / size[1])
        cut = np.array([across, across * size[1] / size[0]])
        corner = np.clip((low + high) / 2 - cut / 2, 0, whole - cut)
        return cls(pictures, corner, size[0] / across, size)

    def picture(self, number: int) -> np.ndarray:
        """A picture as it is drawn, BGR, of `size`; grey where it is damaged."""
        image = self.pictures[number]
        if image is None:
            return np.full((*self.size[::-1], 3), 128, np.uint8)
        # a pixel's middle is its whole number, in the picture and in what is drawn
        offset = self.scale * (0.5 - self.corner) - 0.5
        matrix = np.array([[self.scale, 0, offset[0]], [0, self.scale, offset[1]]])
        return cv2.warpAffine(
            image, matrix, self.size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
        )

    def places(self, points: np.ndarray) -> np.ndarray:
        """Where points (N, 3) are drawn, shape (N, 2)."""
        return (self.pictures.project(points) - self.corner + 0.5) * self.scale - 0.5

    def draw(self, image: np.ndarray, line: np.ndarray) -> None:
        """Draw a simulated line (N, 3) into a picture of `size`."""
        curve(image, self.places(line))


def curve(image: np.ndarray, places: np.ndarray) -> None:
    """Draw the simulated band through places (N, 2) of an image."""
    places = places[np.isfinite(places).all(axis=1)]
    whole = [np.round(places * 2**SHIFT).astype(np.int32)]
    white = image.copy()
    cv2.polylines(white, whole, False, (255, 255, 255), WIDTH + GLOW, cv2.LINE_AA, SHIFT)
    cv2.addWeighted(white, LIGHT, image, 1 - LIGHT, 0, image)
    cv2.polylines(image, whole, False, bgr(SIMULATED), WIDTH, cv2.LINE_AA, SHIFT)
