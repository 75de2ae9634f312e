"""The animation on README.md: a pull, its simulation, and launches by two methods.

    python tools/hero.py band2    # from a run's data; writes docs/hero.webp

First the recorded pull of BAND_dip beside its simulation; then its release, 50 times slower, paused
at each picture of the camera; then virtual launches at one target by this project's method and by
the paper's, which has BAND's recording without a dip, with the predicted 90 % intervals.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image, ImageDraw

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from pipeline.base import errors  # noqa: E402
from pipeline.base.errors import UserError  # noqa: E402
from pipeline.base.files import replacing  # noqa: E402
from pipeline.base.layout import Layout, made  # noqa: E402
from pipeline.episode.episode import Episode  # noqa: E402
from pipeline.identify.results.theta import load_theta  # noqa: E402
from pipeline.params import load  # noqa: E402
from pipeline.report.card.animation import (  # noqa: E402
    HEAD,
    SLOWER,
    STEP,
    TALL,
    WIDE,
    ReleaseFrames,
    font,
)
from pipeline.report.card.camera import Pictures  # noqa: E402
from pipeline.report.card.simulated import simulate  # noqa: E402
from pipeline.report.drawing.styles import INK  # noqa: E402

PAGE = ROOT / "docs" / "hero.webp"
OURS, PAPER = "least_squares", "sling2sim2real"
PULL_STEP, PULL_SHOWN = 0.24, 80  # s between frames of the pull, and ms for each
LOOK = 600  # ms for which a new picture is looked at
BEFORE, AFTER = -0.02, 0.05  # of the release [s]
FLIGHT_SHOWN, HOLD = 50, 2500  # ms for each point of a flight, and for the last frame
QUALITY = 40
Y, LOW = (-0.5, 2.5), -0.56  # m that a row of launches shows, and its lower edge
ROW = (HEAD + TALL) // 2  # pixels of its height
GREY, PALE, OUR, THEIR = "#8a8a8a", "#d5d5d5", "#e0007a", "#0072b2"
Frame = tuple[Image.Image, int]  # and how long it is shown [ms]


@dataclass(frozen=True)
class LaunchRow:
    """One method's launches at one target, from the side.

    Attributes:
        top: Upper edge in the picture [pixels].
        trials: Of the target, as the stage `trials` has them.
    """

    title: str
    color: str
    top: int
    trials: pd.DataFrame

    @property
    def interval(self) -> tuple[float, float]:
        """Predicted interval of 90 % of the landings [m]."""
        first = self.trials.iloc[0]
        return first.predicted_low, first.predicted_high

    def place(self, y: float, z: float) -> tuple[float, float]:
        """Pixels of a point (y, z) [m] of frame O."""
        scale = 2 * WIDE / (Y[1] - Y[0])
        return scale * (y - Y[0]), self.top + ROW - scale * (z - LOW)

    def flight(self, number: int) -> np.ndarray:
        """Way of a launch (y, z) [m], shape (K, 2)."""
        row = self.trials.iloc[number]
        return np.stack([row.flight_y, row.flight_z], axis=1)

    def still(self, draw: ImageDraw.ImageDraw, floor: float, target: float) -> None:
        """Title, fork, floor, target and predicted interval."""
        low, high = self.interval
        draw.text((10, self.top + 6), self.title, fill=self.color, font=font(16, bold=True))
        draw.line((*self.place(Y[0], floor), *self.place(Y[1], floor)), fill=PALE, width=2)
        draw.line((*self.place(0, floor), *self.place(0, 0)), fill=GREY, width=4)
        draw.line((*self.place(low, floor), *self.place(high, floor)), fill=self.color, width=7)
        u, v = self.place(target, floor)
        draw.line((u, v - 26, u, v + 8), fill=INK, width=2)
        draw.text((u, v - 44), "target", fill=INK, font=font(13), anchor="ma")
        u, v = self.place(high, floor)
        draw.text((u + 8, v - 16), "90 % predicted", fill=self.color, font=font(13))

    def drawn(self, draw: ImageDraw.ImageDraw) -> None:
        """The held band, from the side."""
        row = self.trials.iloc[0]
        held = self.place(row.draw_y, row.draw_z)
        draw.line((*self.place(0, 0), *held), fill=self.color, width=3)
        self.ball(draw, held)

    def ball(self, draw: ImageDraw.ImageDraw, at: tuple[float, float], size: int = 5) -> None:
        u, v = at
        draw.ellipse((u - size, v - size, u + size, v + size), fill=INK)

    def flying(self, draw: ImageDraw.ImageDraw, part: float) -> None:
        """The first launch, up to a part of its way."""
        way = self.flight(0)
        upto = max(2, round(part * len(way)))
        places = [self.place(y, z) for y, z in way[:upto]]
        draw.line(places, fill=self.color, width=2)
        self.ball(draw, places[-1])

    def landed(self, draw: ImageDraw.ImageDraw, target: float) -> None:
        """Where all launches ended, and how far from the target on average."""
        ends = np.array([self.flight(number)[-1] for number in range(len(self.trials))])
        for y, z in ends:
            self.ball(draw, self.place(y, z), 3)
        low, high = self.interval
        inside = int(((ends[:, 0] >= low) & (ends[:, 0] <= high)).sum())
        off = 100 * np.abs(ends[:, 0] - target).mean()
        text = f"{len(ends)} virtual launches: {off:.0f} cm from the target, {inside} as predicted"
        draw.text((10, self.top + 28), text, fill=INK, font=font(14))


def recorded(band: str) -> list[Frame]:
    """The pull, and its release."""
    params, layout = load(ROOT / "params.yaml"), Layout(ROOT)
    episode = Episode.load_all(layout.episodes(band))[0]
    theta = load_theta(layout.theta(band, OURS), band)
    pictures = Pictures.of(
        layout.raw(band) / episode.metadata["input"]["file"], episode, params.setup
    )
    simulated = simulate(params, band, OURS, episode, theta)
    begin, release = episode.grasp_time, simulated.release
    shown = episode, simulated, pictures, params.setup.fork_width, begin
    frames = ReleaseFrames(*shown)
    quick = ReleaseFrames(*shown, f"{PULL_STEP * 1000 / PULL_SHOWN:.0f} times faster")
    pull = [
        (quick.frame(time), PULL_SHOWN)
        for time in np.arange(begin + 0.5, release + BEFORE, PULL_STEP)
    ]
    times = np.arange(BEFORE, AFTER + STEP / 2, STEP) + release
    taken = pictures.time + simulated.camera
    new = taken[(taken > times[0]) & (taken < times[-1])]
    times = np.union1d(times, new)
    lasts = 1000 * SLOWER * np.diff(times, append=times[-1] + STEP)
    lasts[np.isin(times, new)] += LOOK
    return pull + [
        (frames.frame(time), round(last)) for time, last in zip(times, lasts, strict=True)
    ]


def launched(band: str, target: float | None = None) -> list[Frame]:
    """Launches by both methods: drawn, flying, landed."""
    params, layout = load(ROOT / "params.yaml"), Layout(ROOT)
    target = target or params.trials.targets[1]
    rows = []
    for title, color, name, method in (
        ("this project, from one pull with dips", OUR, f"{band}_dip", OURS),
        ("the paper's method, from the paper's pull", THEIR, band, PAPER),
    ):
        trials = pd.read_parquet(made(layout.trials(name, method)))
        trials = trials[trials.target == target]
        if any(way is None for way in trials.flight_y):
            raise UserError(f"{name}: launches at {target:g} m did not fly; name another band")
        rows.append(LaunchRow(title, color, len(rows) * ROW, trials))

    def frame(part: float) -> Image.Image:
        image = Image.new("RGB", (2 * WIDE, HEAD + TALL), "white")
        draw = ImageDraw.Draw(image)
        for row in rows:
            row.still(draw, -params.setup.fork_height, target)
            if part == 0:
                row.drawn(draw)
            else:
                row.flying(draw, min(part, 1.0))
            if part >= 1:
                row.landed(draw, target)
        return image

    steps = [(frame(part), FLIGHT_SHOWN) for part in np.linspace(0.05, 0.975, 24)]
    return [(frame(0), 900), *steps, (frame(1), HOLD)]


def main() -> None:
    if len(sys.argv) != 2:
        raise UserError("usage: python tools/hero.py BAND")
    band = sys.argv[1]
    frames, lasts = zip(*recorded(f"{band}_dip"), *launched(band), strict=True)
    with replacing(PAGE) as temporary:
        frames[0].save(
            temporary, format="webp", save_all=True, append_images=frames[1:], loop=0,
            duration=list(lasts), quality=QUALITY, method=4,
        )  # fmt: skip
    print(f"{PAGE}: {len(frames)} frames, {sum(lasts) / 1000:.1f} s")


if __name__ == "__main__":
    errors.run(main)
