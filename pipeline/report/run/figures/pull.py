"""The recording beside the calibrated simulation: force against draw, and what is left over."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from pipeline.episode.episode import Episode
from pipeline.report.drawing.canvas import mark, picture
from pipeline.report.drawing.styles import INK, Styles
from pipeline.report.run.figures.panels import entitle, explain
from pipeline.report.run.figures.policy import DASHES
from pipeline.report.run.replay import MethodReplay

SLACK, MARGIN = 0.05, 0.04  # of the peak force, below which the band is slack; of its draw [m]


@picture()
def pull(
    episodes: dict[str, Episode], replays: dict[str, dict[str, MethodReplay]], styles: Styles
) -> Figure:
    """A column a band: force against draw, residual force, and how far the clouds are off.

    Args:
        replays: By band and method; none shows the recordings alone.
    """
    size = max(3.9 * len(episodes), 5.6), 7.2
    figure, axes = plt.subplots(
        3, len(episodes), figsize=size, squeeze=False, sharey="row", height_ratios=(1.5, 1, 1)
    )
    entitle(figure, "A good simulation lies on the black curve and leaves little in the rows below")
    for (top, middle, bottom), (band, episode) in zip(axes.T, episodes.items(), strict=True):
        held = _held(episode)
        draw = np.linalg.norm(episode.position[held, 1:], axis=1)
        force = np.linalg.norm(episode.force, axis=1)
        top.plot(draw, force[held], color=INK, lw=2)
        taut = draw[force[held] > SLACK * force[held].max()]
        top.set_xlim(max(taut.min() - MARGIN, 0), draw.max() + MARGIN / 4)
        for (method, replay), dash in zip(replays.get(band, {}).items(), DASHES, strict=False):
            style = {"color": styles[method].color, "lw": 1.3, "ls": dash}
            top.plot(draw, np.linalg.norm(replay.force[held], axis=1), **style)
            left = np.linalg.norm(episode.force - replay.force, axis=1)
            middle.plot(episode.time, left, **style | {"lw": 0.9})
            dots = style | {"ls": "", "marker": ".", "ms": 3}
            bottom.plot(episode.cloud_time, 100 * replay.distance, **dots)
        for ax in (middle, bottom):
            ax.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
            ax.set_xlim(episode.time[[0, -1]])
        top.set(title=band, xlabel="draw: the hand's distance from the fork [m]")
        bottom.set_xlabel("time [s] (grey line: release)")
    labels = "force of the band [N]", "|residual| [N]", "clouds off by [cm]"
    for ax, label in zip(axes[:, 0], labels, strict=True):
        ax.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    methods = dict.fromkeys(method for of_band in replays.values() for method in of_band)
    curves = [
        (styles[method].name, mark(color=styles[method].color, ls=dash))
        for method, dash in zip(methods, DASHES, strict=False)
    ]
    explain(figure, [("measured", mark(color=INK, lw=2)), *curves])
    return figure


def _held(episode: Episode) -> np.ndarray:
    """Samples from grasp to release, but for the last, which mix in the release, shape (T,)."""
    last = episode.release_time - 2 * episode.sample_period
    return (episode.time >= episode.grasp_time) & (episode.time <= last)
