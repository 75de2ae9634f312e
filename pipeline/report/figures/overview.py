"""Figure 1 of the paper: from one recording to launches, with the data of one band."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pipeline.report.figures.panels import entitle
from pipeline.report.figures.pull import held_samples
from pipeline.report.noise import landed
from pipeline.report.replay import MethodReplay
from sling2sim2real.drawing.canvas import key, mark, picture
from sling2sim2real.drawing.styles import INK, Style
from sling2sim2real.episode.episode import Episode


@picture()
def overview(
    episode: Episode, replay: MethodReplay, draws: np.ndarray, trials: pd.DataFrame, style: Style
) -> Figure:
    """Recording, calibrated simulator, policy and launches, a panel each.

    Args:
        draws: Of the policy from the nearest to the farthest target [m], shape (N, 2).
        trials: Launches with a target, of the same method.
    """
    figure, ((record, fit), (policy, launch)) = plt.subplots(2, 2, figsize=(5.6, 4.9))
    entitle(figure, f"From one recording of {episode.band} to launches ({style.name})")
    force = np.linalg.norm(episode.force, axis=1)
    simulated = np.linalg.norm(replay.force, axis=1)
    distance = np.linalg.norm(episode.position[:, 1:], axis=1)
    held = held_samples(episode)
    color = style.color
    record.plot(episode.time, force, color=INK, lw=1.2)
    record.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
    record.set(xlabel="time [s]", ylabel="force [N]", title="1 pull, pause, release")
    fit.plot(distance[held], force[held], color=INK, lw=2.2)
    fit.plot(distance[held], simulated[held], color=color, lw=1.1)
    fit.set(xlabel="draw [m]", ylabel="force [N]", title="2 calibrated simulator")
    policy.plot(*draws.T, color=color, lw=2)
    policy.plot(*draws[0], "o", color=color, ms=5)
    policy.set(xlabel="draw y [m]", ylabel="draw z [m]", title="3 policy: near (dot) to far")
    policy.margins(0.3)
    good = trials.loc[landed(trials)]
    ends = [trials.target.min(), trials.target.max()]
    launch.plot(ends, ends, color="0.6", lw=0.8)
    launch.plot(good.target, good.landing_y, ".", color=color, ms=6)
    failed = len(trials) - len(good)
    title = "4 launches" + (f", {failed} failed" if failed else "")
    launch.set(xlabel="target [m]", ylabel="landing [m]", title=title)
    for ax in figure.axes:
        ax.title.set_fontsize(9)
    entries = [("recorded", mark(color=INK, lw=2)), (style.name, mark(color=color, lw=2))]
    key(figure, [*entries, ("on target", mark(color="0.6", lw=0.8))])
    return figure
