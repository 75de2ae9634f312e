"""The animation on README.md: a pull, its simulation, and launches by two methods.

    python tools/hero.py band2    # from a run's data; writes docs/hero.webp

First the pull with dips of BAND beside its simulation; then its release, 50 times slower, paused
at each picture of the camera; then virtual launches of BAND at one target by the paper's method, by
`posterior` from the same pull, and by `posterior` from the pull with dips, with the predicted 90 %
intervals where a method has them.
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

from pipeline.band_folder import identified  # noqa: E402
from pipeline.layout import Layout  # noqa: E402
from pipeline.params import load  # noqa: E402
from pipeline.params.run import Pair  # noqa: E402
from sling2sim2real.base import errors  # noqa: E402
from sling2sim2real.base.errors import UserError  # noqa: E402
from sling2sim2real.base.files import made  # noqa: E402
from sling2sim2real.card import animation  # noqa: E402
from sling2sim2real.card.animation import Frame, ReleaseFrames, font, save  # noqa: E402
from sling2sim2real.card.camera import Pictures  # noqa: E402
from sling2sim2real.card.simulated import simulate  # noqa: E402
from sling2sim2real.drawing.styles import INK  # noqa: E402
from sling2sim2real.episode.episode import Episode  # noqa: E402

PAGE = ROOT / "docs" / "hero.webp"
OURS, PAPER = "posterior", "paper"
PULL_STEP, PULL_SHOWN = 0.24, 80  # s between frames of the pull, and ms for each
BEFORE, AFTER = -0.02, 0.05  # of the release [s]
DRAWN, FLIGHT_SHOWN, HOLD = 900, 50, 2500  # ms before a flight, for each of its points, and after
QUALITY = 40
Y, LOW = (-0.5, 3.4), -0.56  # m that a row of launches shows, and its lower edge
WIDE, TALL = 2 * animation.WIDE, animation.HEAD + animation.TALL  # pixels of a frame
ROWS = 3
ROW = TALL // ROWS
GREY, PALE, OUR, THEIR = "#8a8a8a", "#d5d5d5", "#e0007a", "#0072b2"


@dataclass(frozen=True)
class LaunchRow:
    """One method's launches at one target, from the side.

    Attributes:
        top: Upper edge in the picture [pixels].
        floor, target: Its height z, and the distance y on it [m].
        trials: Of the target, as the stage `trials` has them.
    """

    title: str
    color: str
    top: int
    floor: float
    target: float
    trials: pd.DataFrame

    def place(self, y: float, z: float) -> tuple[float, float]:
        """Pixels of a point (y, z) [m] of frame O."""
        scale = WIDE / (Y[1] - Y[0])
        return scale * (y - Y[0]), self.top + ROW - scale * (z - LOW)

    def draw(self, draw: ImageDraw.ImageDraw, part: float) -> None:
        """The fork, and a launch up to a part of its way: 0 is drawn, at 1 all have landed."""
        first, floor, color = self.trials.iloc[0], self.floor, self.color
        bold, interval = font(16, bold=True), np.isfinite(first.predicted_low)

        def line(*points: tuple[float, float], fill: str, width: int = 2) -> None:
            draw.line([self.place(y, z) for y, z in points], fill=fill, width=width)

        def ball(at: tuple[float, float], size: int = 5) -> None:
            u, v = self.place(*at)
            draw.ellipse((u - size, v - size, u + size, v + size), fill=INK)

        draw.text((WIDE - 10, self.top + 6), self.title, fill=color, font=bold, anchor="ra")
        line((Y[0], floor), (Y[1], floor), fill=PALE)
        line((0, floor), (0, 0), fill=GREY, width=4)
        u, v = self.place(self.target, floor)
        draw.line((u, v - 26, u, v + 8), fill=INK, width=2)
        draw.text((u, v - 44), "target", fill=INK, font=font(13), anchor="ma")
        if interval:
            low, high = (first.predicted_low, floor), (first.predicted_high, floor)
            line(low, high, fill=color, width=7)
            u, v = self.place(*high)
            draw.text((u + 8, v - 16), "90 % predicted", fill=color, font=font(13))
        held = first.draw_y, first.draw_z
        way = list(zip(first.flight_y, first.flight_z, strict=True))
        way = [(0, 0), held] if part == 0 else way[: max(2, round(min(part, 1) * len(way)))]
        line(*way, fill=color, width=3 if part == 0 else 2)
        ball(way[-1])
        if part < 1:
            return
        ends = [(row.flight_y[-1], row.flight_z[-1]) for row in self.trials.itertuples()]
        for end in ends:
            ball(end, 3)
        y = np.array(ends)[:, 0]
        off = 100 * np.abs(y - self.target).mean()
        text = f"{len(ends)} virtual launches: {off:.0f} cm from the target"
        if interval:
            inside = ((y >= first.predicted_low) & (y <= first.predicted_high)).sum()
            text += f", {inside} as predicted"
        draw.text((WIDE - 10, self.top + 28), text, fill=INK, font=font(14), anchor="ra")


def recorded(pair: Pair) -> list[Frame]:
    """The pull, and its release."""
    params, layout = load(ROOT / "params.yaml"), Layout(ROOT)
    episode = Episode.load(layout.episode(pair))
    recording = layout.raw(pair) / episode.metadata["input"]["file"]
    pictures = Pictures.of(recording, episode, params.setup)
    simulated = simulate(identified(pair, ROOT), episode)
    begin, release = episode.grasp_time, simulated.release
    shown = episode, simulated, pictures, params.setup.fork_width, begin
    frames = ReleaseFrames(*shown)
    quick = ReleaseFrames(*shown, f"{PULL_STEP * 1000 / PULL_SHOWN:.0f} times faster")
    pull = [
        (quick.frame(time), PULL_SHOWN)
        for time in np.arange(begin + 0.5, release + BEFORE, PULL_STEP)
    ]
    return pull + frames.around_release(BEFORE, AFTER)


def launched(band: str) -> list[Frame]:
    """Launches by the rows' methods and pulls: drawn, flying, landed."""
    params, layout = load(ROOT / "params.yaml"), Layout(ROOT)
    floor, target = -params.setup.fork_height, params.trials.targets[1]
    rows = []
    for title, color, key in (
        ("the paper's method, from the paper's pull", THEIR, f"{band}-{PAPER}"),
        ("posterior, from the paper's pull", OUR, f"{band}-{OURS}"),
        ("posterior, from a pull with dips", OUR, f"{band}-dips-{OURS}"),
    ):
        trials = pd.read_parquet(made(layout.trials(params.run.pairs[key])))
        trials = trials[trials.target == target]
        if any(way is None for way in trials.flight_y):
            raise UserError(f"{key}: launches at {target:g} m did not fly; name another band")
        rows.append(LaunchRow(title, color, len(rows) * ROW, floor, target, trials))
    frames = []
    for part in (0, *np.linspace(0.05, 0.975, 24), 1):
        image = Image.new("RGB", (WIDE, TALL), "white")
        for row in rows:
            row.draw(ImageDraw.Draw(image), part)
        frames.append((image, {0: DRAWN, 1: HOLD}.get(part, FLIGHT_SHOWN)))
    return frames


def main() -> None:
    if len(sys.argv) != 2:
        raise UserError("usage: python tools/hero.py BAND")
    band = sys.argv[1]
    pair = load(ROOT / "params.yaml").run.pairs[f"{band}-dips-{OURS}"]
    frames = [*recorded(pair), *launched(band)]
    save(PAGE, frames, QUALITY)
    print(f"{PAGE}: {len(frames)} frames, {sum(shown for _, shown in frames) / 1000:.1f} s")


if __name__ == "__main__":
    errors.run(main)
