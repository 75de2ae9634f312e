"""Figure 1 of the paper: from a recording to launches."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from pipeline.report.data import Result, Run
from pipeline.report.figures.panels import WIDTH, entitle
from sling2sim2real.base.files import NotMade
from sling2sim2real.drawing.canvas import key, mark, picture
from sling2sim2real.drawing.styles import INK, Style
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import calibrated, parameters_of
from sling2sim2real.simulator.interaction import with_recorded_pads
from sling2sim2real.simulator.replay import replay


def replayed(run: Run, result: Result) -> np.ndarray:
    """Force on the hand by one method's θ [N], filtered as the measured one, shape (T, 3).

    Raises NotMade where the pull of the band's episode fails in simulation.
    """
    params, episode = run.params, run.episodes[result.band]
    sling = calibrated(params, result.band, result.theta, run.layout.clamps(result.pair))
    pads = with_recorded_pads(sling, episode)
    done = replay(pads, episode, parameters_of(result.theta), params.force)
    if failure := done.rollouts.failure[0]:
        raise NotMade(run.layout.theta(result.pair), failure)
    return done.force[0]


def held_samples(episode: Episode) -> np.ndarray:
    """Samples from grasp to release, but for the last, which mix in the release, shape (T,)."""
    last = episode.release_time - 2 * episode.sample_period
    return (episode.time >= episode.grasp_time) & (episode.time <= last)


@picture()
def overview(
    episode: Episode, replay: np.ndarray, draws: np.ndarray, trials: pd.DataFrame, style: Style
) -> Figure:
    """Figure 1 of the paper: recording, calibrated simulator, policy and launches, a panel each.

    Args:
        replay: Force on the hand in the simulation [N], shape (T, 3).
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
    fit.plot(distance[held], np.linalg.norm(replay, axis=1)[held], color=color, lw=1.1)
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
