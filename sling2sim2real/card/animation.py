"""animation.webp: the release, 50 times slower, as recorded and as simulated."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import cv2
import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from sling2sim2real.base.files import replacing
from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.camera_view import SIMULATED, CameraView, bgr, curve
from sling2sim2real.card.simulated import Simulated
from sling2sim2real.drawing.styles import INK
from sling2sim2real.episode.episode import Episode

SLOWER = 50
STEP = 2.5e-3  # s between frames, of the recording
BEGIN, END = -0.03, 0.105  # of the release [s]
LOOK = 700  # ms for which a new picture is looked at
LAST = 1500  # ms for the last frame
WIDE, TALL, HEAD = 400, 366, 52  # pixels of each half, and of the line above
QUALITY = 36
REACH = (-0.46, 0.36)  # y that is shown [m]
ABOVE, BELOW = (-0.2, 0.2), (-0.27, 0.17)  # x from above, z from the side [m]
DOT = 1  # radius of a point
GREY, PALE = "#8a8a8a", "#c9c9c9"
AGED = 0.03  # s after which clouds are pale
Frame = tuple[Image.Image, int]  # and how long it is shown [ms]


def animate(
    path: Path, episode: Episode, simulated: Simulated, pictures: Pictures, fork_width: float
) -> None:
    """Write the animation."""
    drawn = ReleaseFrames(episode, simulated, pictures, fork_width)
    frames = drawn.around_release(BEGIN, END)
    looked_at = [n for n, (_, shown) in enumerate(frames) if shown >= LOOK]
    frames = frames[: looked_at[-1] + 1] if looked_at else frames  # it ends as it compares
    save(path, [*frames[:-1], (frames[-1][0], LAST)], QUALITY)


def save(path: Path, frames: list[Frame], quality: int) -> None:
    """Write frames as an animated WebP."""
    images, shown = zip(*frames, strict=True)
    with replacing(path) as temporary:
        images[0].save(
            temporary, format="webp", save_all=True, append_images=images[1:], loop=0,
            duration=list(shown), quality=quality, method=2,
        )  # fmt: skip


@dataclass
class ReleaseFrames:
    """Frames of a pull at any moment: its latest picture beside the simulated band.

    Attributes:
        begin: From which moment on the band lies in the cut of the pictures [s]; None: its release.
        pace: Of time, in the line above.
    """

    episode: Episode
    simulated: Simulated
    pictures: Pictures
    fork_width: float
    begin: float | None = None
    pace: str = f"{SLOWER} times slower"

    def __post_init__(self) -> None:
        self._taken = self.pictures.time + self.simulated.camera
        self._seen = self.episode.cloud_time + self.simulated.camera
        self._picture = lru_cache(2)(self._view.picture)

    @cached_property
    def _view(self) -> CameraView:
        return CameraView.of(self.pictures, self.simulated, (WIDE, TALL), self.begin)

    def around_release(self, begin: float, end: float) -> list[Frame]:
        """Frames from `begin` to `end` [s] of the release.

        The moment of each new picture comes in too, so that it is compared with its own state; it
        is shown LOOK longer.
        """
        times = np.arange(begin, end + STEP / 2, STEP) + self.simulated.release
        new = self._taken[(self._taken > times[0]) & (self._taken < times[-1])]
        times = np.union1d(times, new)
        shown = np.diff(times, append=times[-1] + STEP) * 1000 * SLOWER
        shown[np.isin(times, new)] += LOOK
        return [(self.frame(time), round(ms)) for time, ms in zip(times, shown, strict=True)]

    def frame(self, time: float) -> Image.Image:
        canvas = self._background.copy()
        line = self.simulated.line(time)
        number = max(int(np.searchsorted(self._taken, time, side="right")) - 1, 0)
        left = self._picture(number).copy()
        self._view.draw(left, self.simulated.line(self._taken[number]))
        canvas[HEAD:, :WIDE] = left
        cloud = max(int(np.searchsorted(self._seen, time, side="right")) - 1, 0)
        age = self._aged(time - self._seen[cloud])
        color = tuple((1 - age) * np.array(bgr(INK)) + age * np.array(bgr(PALE)))
        for place in _plans(self.episode.clouds[cloud]):
            for u, v in np.round(place).astype(int):
                if v >= HEAD:
                    cv2.circle(canvas, (int(u), int(v)), DOT, color, -1, cv2.LINE_AA)
        for place in _plans(line):
            curve(canvas, place)
        image = Image.fromarray(canvas[..., ::-1])
        draw, release = ImageDraw.Draw(image), self.simulated.release
        clock = f"t = {_milliseconds(time - release)}"
        draw.text((2 * WIDE - 12, 8), clock, fill=INK, font=font(19, bold=True), anchor="ra")
        caption = f"picture of {_milliseconds(self._taken[number] - release)}"
        draw.text((10, HEAD + TALL - 24), caption, fill="white", font=font(13))
        return image

    @staticmethod
    def _aged(since: float) -> float:
        """Age of a cloud, from 0 of a new one to 1 after AGED."""
        return float(np.clip(since / AGED, 0, 1))

    @cached_property
    def _background(self) -> np.ndarray:
        """What keeps still: titles, fork, axes."""
        image = Image.new("RGB", (2 * WIDE, TALL + HEAD), "white")
        draw, title, small = ImageDraw.Draw(image), font(19, bold=True), font(13)
        draw.text((10, 8), "recording", fill=INK, font=title)
        draw.text(
            (10, 31), "camera picture, with the simulated band of its time", fill=GREY, font=small
        )
        draw.text((WIDE + 12, 8), "simulation", fill=SIMULATED, font=title)
        text = f"dots: the camera's points; {self.pace}"
        draw.text((WIDE + 12, 31), text, fill=GREY, font=small)
        half = self.fork_width / 2
        above, side = (_scaled([[0, -half, 0], [0, half, 0]]), _scaled([[0, 0, 0]]))
        base = HEAD + TALL
        for u, v in above[0]:
            draw.ellipse((u - 5, v - 5, u + 5, v + 5), fill=PALE)
        ((u, v),) = side[1]
        draw.rectangle((u - 3, v, u + 3, base), fill=PALE)
        split = _split()
        draw.line((WIDE, split, 2 * WIDE, split), fill=PALE)
        draw.text((2 * WIDE - 10, split - 20), "from above", fill=GREY, font=small, anchor="ra")
        draw.text((2 * WIDE - 10, split + 6), "from the side", fill=GREY, font=small, anchor="ra")
        scale, bottom = _pixels(), base - 16
        ends = WIDE + 14, WIDE + 14 + 0.1 * scale
        draw.line((ends[0], bottom, ends[1], bottom), fill=INK, width=2)
        draw.text((sum(ends) / 2, bottom - 18), "10 cm", fill=INK, font=small, anchor="ma")
        return np.ascontiguousarray(np.asarray(image)[..., ::-1])


def _milliseconds(since: float) -> str:
    sign = "−" if since < -5e-5 else "+"
    if abs(since) >= 1:
        return f"{sign}{abs(since):.1f} s"
    return f"{sign}{abs(1000 * since):.1f} ms"


def _pixels() -> float:
    """Number of pixels for a metre."""
    return WIDE / (REACH[1] - REACH[0])


def _split() -> int:
    """Row between the two views."""
    return HEAD + round((ABOVE[1] - ABOVE[0]) * _pixels())


def _plans(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of points (N, 3) from above and from the side, shape (N, 2) each."""
    points = np.asarray(points, float).reshape(-1, 3)
    u = WIDE + (points[:, 1] - REACH[0]) * _pixels()
    above = HEAD + (points[:, 0] - ABOVE[0]) * _pixels()
    side = _split() + (BELOW[1] - points[:, 2]) * _pixels()
    return np.stack([u, above], 1), np.stack([u, side], 1)


def _scaled(places: list) -> tuple[np.ndarray, np.ndarray]:
    """The same of (y, x, z)."""
    return _plans(np.array(places, float)[:, [1, 0, 2]])


@lru_cache
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """The one that matplotlib brings."""
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path(), "fonts", "ttf", name)), size)
