"""The recording beside the calibrated simulation: force against draw, and what is left over."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from pipeline.report.figures.panels import WIDTH, entitle, explain
from pipeline.report.figures.policy import DASHES
from pipeline.report.replay import MethodReplay
from sling2sim2real.drawing.canvas import mark, picture
from sling2sim2real.drawing.styles import INK, Styles
from sling2sim2real.episode.episode import Episode

SLACK, MARGIN = 0.05, 0.04  # of the peak force, below which the band is slack; of its draw [m]


@picture()
def pull(
    episodes: dict[str, Episode], replays: dict[str, dict[str, MethodReplay]], styles: Styles
) -> Figure:
    """Plot by band force against draw, and beside it residual force and distance of the clouds.

    Args:
        replays: By band and method; none shows the recordings alone.
    """
    figure = plt.figure(figsize=(WIDTH, 2.6 * len(episodes) + 0.9))
    entitle(figure, "A good simulation lies on the black curve and leaves little beside it")
    grid = figure.add_gridspec(2 * len(episodes), 2)
    for row, (band, episode) in zip(range(0, 2 * len(episodes), 2), episodes.items(), strict=True):
        held = held_samples(episode)
        top = figure.add_subplot(grid[row : row + 2, 0])
        middle, bottom = (figure.add_subplot(grid[place, 1]) for place in (row, row + 1))
        draw = np.linalg.norm(episode.position[held, 1:], axis=1)
        force = np.linalg.norm(episode.force, axis=1)
        top.plot(draw, force[held], color=INK, lw=2)
        taut = draw[force[held] > SLACK * force[held].max()]
        top.set_xlim(max(taut.min() - MARGIN, 0), draw.max() + MARGIN / 4)
        for (method, replay), dash in zip(replays.get(band, {}).items(), DASHES, strict=False):
            style: dict[str, Any] = {"color": styles[method].color, "lw": 1.3, "ls": dash}
            top.plot(draw, np.linalg.norm(replay.force[held], axis=1), **style)
            left = np.linalg.norm(episode.force - replay.force, axis=1)
            middle.plot(episode.time, left, **{**style, "lw": 0.9})
            dots = {"color": styles[method].color, "ls": "", "marker": ".", "ms": 3}
            bottom.plot(episode.cloud_time, 100 * replay.distance, **dots)
        for ax in (middle, bottom):
            ax.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
            ax.set_xlim(episode.time[0], episode.time[-1])
        middle.tick_params(labelbottom=False)
        top.set(title=band, xlabel="draw: hand to fork [m]", ylabel="force of the band [N]")
        middle.set_ylabel("|residual| [N]")
        bottom.set(xlabel="time [s] (grey line: release)", ylabel="clouds off by [cm]")
    methods = dict.fromkeys(method for of_band in replays.values() for method in of_band)
    curves = [
        (styles[method].name, mark(color=styles[method].color, ls=dash))
        for method, dash in zip(methods, DASHES, strict=False)
    ]
    explain(figure, [("measured", mark(color=INK, lw=2)), *curves])
    return figure


def held_samples(episode: Episode) -> np.ndarray:
    """Samples from grasp to release, but for the last, which mix in the release, shape (T,)."""
    last = episode.release_time - 2 * episode.sample_period
    return (episode.time >= episode.grasp_time) & (episode.time <= last)
