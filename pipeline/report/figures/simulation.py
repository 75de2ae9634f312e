"""The recording beside the calibrated simulation, and figure 1 of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pipeline.report.data import Result, Run
from pipeline.report.figures.panels import DASHES, WIDTH, entitle, explain
from sling2sim2real.base.files import NotMade
from sling2sim2real.drawing.canvas import key, mark, picture
from sling2sim2real.drawing.styles import INK, Style, Styles
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.theta import calibrated, parameters_of
from sling2sim2real.simulator.interaction import with_recorded_pads
from sling2sim2real.simulator.replay import replay

SLACK, MARGIN = 0.05, 0.04  # of the peak force, below which the band is slack; of its draw [m]


@dataclass(frozen=True)
class Replay:
    """A pull as one method's θ plays it.

    Attributes:
        force: On the gripper at the episode's samples, filtered as the measured one, shape (T, 3).
        distance: Of each frame's cloud from the simulated band [m], shape (K,); NaN without points.
    """

    force: np.ndarray
    distance: np.ndarray


def replayed(run: Run, result: Result) -> Replay:
    """Simulate the pull of a band's episode. Raises NotMade where θ fails in simulation."""
    params, episode = run.params, run.episodes[result.band]
    sling = calibrated(params, result.band, result.theta, run.layout.clamps(result.pair))
    loss = EpisodeLoss.of(params, result.method, episode, sling)
    pads = with_recorded_pads(sling, episode)
    done = replay(pads, episode, parameters_of(result.theta), params.force)
    if failure := done.rollouts.failure[0]:
        raise NotMade(run.layout.theta(result.pair), failure)
    return Replay(done.force[0], loss.frames(done.rollouts)[0])


@picture()
def pull(
    episodes: dict[str, Episode], replays: dict[str, dict[str, Replay]], styles: Styles
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
        for (method, played), dash in zip(replays.get(band, {}).items(), cycle(DASHES)):
            style = {"color": styles[method].color, "ls": dash}
            top.plot(draw, np.linalg.norm(played.force[held], axis=1), lw=1.3, **style)
            left = np.linalg.norm(episode.force - played.force, axis=1)
            middle.plot(episode.time, left, lw=0.9, **style)
            style["ls"] = ""
            bottom.plot(episode.cloud_time, 100 * played.distance, marker=".", ms=3, **style)
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
        for method, dash in zip(methods, cycle(DASHES))
    ]
    explain(figure, [("measured", mark(color=INK, lw=2)), *curves])
    return figure


def held_samples(episode: Episode) -> np.ndarray:
    """Samples from grasp to release, but for the last, which mix in the release, shape (T,)."""
    last = episode.release_time - 2 * episode.sample_period
    return (episode.time >= episode.grasp_time) & (episode.time <= last)


@picture()
def overview(
    episode: Episode, replay: Replay, draws: np.ndarray, trials: pd.DataFrame, style: Style
) -> Figure:
    """Figure 1 of the paper: recording, calibrated simulator, policy and launches, a panel each.

    Args:
        draws: Of the policy from the nearest to the farthest target [m], shape (N, 2).
        trials: Launches with a target, of the same method, as data.py has them.
    """
    figure, ((record, fit), (policy, launch)) = plt.subplots(2, 2, figsize=(WIDTH, 4.9))
    entitle(figure, f"From one recording of {episode.band} to launches ({style.name})")
    force = np.linalg.norm(episode.force, axis=1)
    distance = np.linalg.norm(episode.position[:, 1:], axis=1)
    held, color = held_samples(episode), style.color
    record.plot(episode.time, force, color=INK, lw=1.2)
    record.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
    record.set(xlabel="time [s]", ylabel="force [N]", title="1 pull, pause, release")
    fit.plot(distance[held], force[held], color=INK, lw=2.2)
    fit.plot(distance[held], np.linalg.norm(replay.force, axis=1)[held], color=color, lw=1.1)
    fit.set(xlabel="draw [m]", ylabel="force [N]", title="2 calibrated simulator")
    policy.plot(*draws.T, color=color, lw=2)
    policy.plot(*draws[0], "o", color=color, ms=5)
    policy.set(xlabel="draw y [m]", ylabel="draw z [m]", title="3 policy: near (dot) to far")
    policy.margins(0.3)
    ends = [trials.target.min(), trials.target.max()]
    launch.plot(ends, ends, color="0.6", lw=0.8)
    launch.plot(trials.target, trials.target + trials.miss, ".", color=color, ms=6)
    failed = int(trials.miss.isna().sum())
    title = "4 launches" + (f", {failed} failed" if failed else "")
    launch.set(xlabel="target [m]", ylabel="landing [m]", title=title)
    for ax in figure.axes:
        ax.title.set_fontsize(9)
    entries = [("recorded", mark(color=INK, lw=2)), (style.name, mark(color=color, lw=2))]
    key(figure, [*entries, ("on target", mark(color="0.6", lw=0.8))])
    return figure
