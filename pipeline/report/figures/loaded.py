"""The bands under load: with a weight at their middle, and drawn by the hand."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pipeline.episode.episode import Episode
from pipeline.report.figures.canvas import save
from pipeline.report.figures.episode import DASHES
from pipeline.report.replay import LOAD, Replay
from pipeline.report.styles import INK, THEME, Styles

SLACK, MARGIN = 0.05, 0.04  # of the peak force, below which the band is slack; of its draw [m]


def loaded(
    path: Path,
    episodes: dict[str, Episode],
    replays: dict[str, dict[str, Replay]],
    styles: Styles,
    fork_width: float,
    fork_height: float,
) -> None:
    """A column a band: simulated bands under `LOAD`, to scale, and force against draw.

    Args:
        replays: By band and method.
    """
    shapes = [one.loaded for of_band in replays.values() for one in of_band.values()]
    deepest = np.nanmin([np.nanmin(shape[:, 2], initial=-0.1) for shape in shapes])
    low, half = min(deepest, -fork_height) - 0.05, fork_width / 2 + 0.06
    columns = len(replays)
    wide = min(4.2, 13.0 / columns)
    with plt.rc_context(THEME):
        figure, axes = plt.subplots(
            2, columns, figsize=(columns * wide, 8.2), height_ratios=(1.25, 1), squeeze=False,
            sharey="row",
        )  # fmt: skip
        for (top, bottom), (band, of_band) in zip(axes.T, replays.items(), strict=True):
            _hanging(top, of_band, styles, fork_width, fork_height)
            top.set(xlim=(-half - 0.16, half + 0.16), ylim=(low, 0.03), aspect="equal")
            top.set_title(band, fontsize=10)
            top.set_xlabel("x [m]")
            _drawn(bottom, episodes[band], of_band, styles)
            bottom.set_xlabel("draw: the hand's distance from the fork [m]")
        axes[0, 0].set_ylabel(f"z [m], {LOAD:g} kg at the middle (simulated)")
        axes[1, 0].set_ylabel("force of the recorded pull [N]")
        methods = list(dict.fromkeys(method for of_band in replays.values() for method in of_band))
        handles = [plt.Line2D([], [], color=INK, lw=2)]
        handles += [
            plt.Line2D([], [], color=styles[m].color, **_style(n)) for n, m in enumerate(methods)
        ]
        names = ["measured (the pull alone)", *(styles[method].name for method in methods)]
        figure.legend(handles, names, loc="outside lower center", ncols=3)
        save(figure, path)


def _style(number: int) -> dict:
    return {"lw": 1.5, "ls": DASHES[number % len(DASHES)]}


def _hanging(ax, replays: dict[str, Replay], styles, fork_width: float, fork_height: float) -> None:
    for side in (-1, 1):
        ax.plot([side * fork_width / 2] * 2, [0, -fork_height], color="0.6", lw=3, zorder=1)
    said = []
    for number, (method, replay) in enumerate(replays.items()):
        color, shape = styles[method].color, replay.loaded
        depth = -shape[len(shape) // 2, 2]
        if np.isfinite(depth):
            ax.plot(shape[:, 0], shape[:, 2], color=color, **_style(number), zorder=3)
            ax.plot(0, -depth, "o", ms=7, color=color, mec="w", mew=0.7, zorder=4)
        said.append((f"{100 * depth:.1f} cm" if np.isfinite(depth) else "not found", color))
    for row, (text, color) in enumerate(said):
        place = (0.99, 0.97 - 0.055 * row)
        ax.text(*place, text, transform=ax.transAxes, ha="right", va="top", fontsize=8, color=color)


def _drawn(ax: plt.Axes, episode: Episode, replays: dict[str, Replay], styles) -> None:
    last = episode.release_time - 2 * episode.sample_period  # later samples mix in the release
    held = (episode.time >= episode.grasp_time) & (episode.time <= last)
    draw = np.linalg.norm(episode.position[held, 1:], axis=1)
    size = np.linalg.norm(episode.force[held], axis=1)
    ax.plot(draw, size, color=INK, lw=2, zorder=2)
    taut = draw[size > SLACK * size.max()]
    ax.set_xlim(max(taut.min() - MARGIN, 0), draw.max() + MARGIN / 4)
    for number, (method, replay) in enumerate(replays.items()):
        size = np.linalg.norm(replay.force[held], axis=1)
        ax.plot(draw, size, color=styles[method].color, **_style(number), zorder=3)
