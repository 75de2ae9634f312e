"""Pictures of the report, one function a file. Equal data give equal bytes.

Colours: black for what was measured, one colour a method (in the order of run.methods).
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.ticker import LogFormatter

from pipeline.episode import Episode
from pipeline.files import replacing
from pipeline.policy.landing_map import LandingMap
from pipeline.policy.trials import stretch_of
from pipeline.report.replay import Replay
from pipeline.report.results import Result
from pipeline.style import COLORS, INK, STYLE


def color(number: int) -> str:
    return COLORS[number % len(COLORS)]


def force(path: Path, episode: Episode, replays: dict[str, Replay]) -> None:
    """Measured and simulated force over time, y and z, and the recoil magnified."""
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 2, figsize=(9, 4.6), width_ratios=(2.4, 1), sharex="col")
        for axis, row in ((1, axes[0]), (2, axes[1])):
            for ax in row:
                ax.plot(episode.time, episode.force[:, axis], color=INK, lw=2, label="measured")
                for number, (method, replay) in enumerate(replays.items()):
                    style = {"color": color(number), "lw": 1.2, "ls": ("-", "--", ":")[number % 3]}
                    ax.plot(episode.time, replay.force[:, axis], label=method, **style)
                ax.axvline(episode.release_time, color="0.6", lw=0.8)
            row[0].set_ylabel(f"force on the hand, {'xyz'[axis]} [N]")
        axes[1, 0].set_xlabel("time [s] (grey line: release)")
        axes[1, 1].set_xlabel("time around the release [s]")
        axes[1, 1].set_xlim(episode.release_time - 0.5, episode.release_time + 0.5)
        axes[0, 0].legend(loc="upper left")
        _save(figure, path)


def moments(episode: Episode) -> dict[str, int]:
    """Frames to look at: hang, held at full draw, first that shows the recoil, swing."""
    stamps = episode.cloud_time

    def nearest(time: float) -> int:
        return int(np.abs(stamps - time).argmin())

    moved = episode.release_time + 0.01  # by then the band has left the hand by some centimetres
    after = int(np.searchsorted(stamps, moved, side="right"))
    return {
        "hanging": nearest(max(stamps[0], episode.grasp_time - 0.1)),
        "held at full draw": nearest(episode.release_time - 0.2),
        "first frame of the recoil": min(after, len(stamps) - 1),
        "swinging": nearest(min(episode.release_time + 0.5, stamps[-1])),
    }


def clouds(path: Path, episode: Episode, replays: dict[str, Replay], diameter: float) -> None:
    """Measured points and simulated bands at four moments, seen from three sides at one scale."""
    views = (("from the side", 1, 2), ("from above", 1, 0), ("along y", 0, 2))
    seen = [points for points in episode.clouds if len(points)]
    seen += [replay.center_line.reshape(-1, 3) for replay in replays.values()]
    low = np.min([points.min(0) for points in seen], axis=0) - 0.03
    high = np.max([points.max(0) for points in seen], axis=0) + 0.03
    wide = max(high[1] - low[1], high[0] - low[0])
    tall = [high[up] - low[up] for _, _, up in views]
    inches = 2.5 / wide
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            3, 4, figsize=(11, inches * sum(tall) + 2.2), sharex="row", sharey="row",
            height_ratios=tall,
        )  # fmt: skip
        for column, (name, frame) in enumerate(moments(episode).items()):
            since = episode.cloud_time[frame] - episode.release_time
            axes[0, column].set_title(f"{name}\n{since:+.3f} s from the release", fontsize=9)
            points = episode.clouds[frame]
            for ax, (_, across, up) in zip(axes[:, column], views, strict=True):
                ax.plot(points[:, across], points[:, up], ".", ms=1.2, color=INK, zorder=2.5)
                for number, replay in enumerate(replays.values()):
                    line = replay.center_line[frame][:, [across, up]].T
                    ax.plot(*line, color=color(number), lw=0.9, zorder=3)
                    ax.plot(*line, color=color(number), alpha=0.3, zorder=2, gid="tube")
                ax.set_aspect("equal")
        for row, (view, across, up) in zip(axes, views, strict=True):
            middle = (low[across] + high[across]) / 2
            row[0].set(xlim=(middle - wide / 2, middle + wide / 2), ylim=(low[up], high[up]))
            row[0].set_ylabel(f"{'xyz'[up]} [m]\n{view}")
            for ax in row:
                ax.set_xlabel(f"{'xyz'[across]} [m]", labelpad=0)
        dots = [plt.Line2D([], [], ls="", marker=".", color=INK)]
        lines = [plt.Line2D([], [], color=color(number)) for number in range(len(replays))]
        names = ["measured points", *replays]
        figure.legend(dots + lines, names, loc="outside lower center", ncols=4)
        figure.draw_without_rendering()  # the layout decides how many points a metre takes
        for ax in axes.flat:
            per_metre = np.diff(ax.transData.transform([[0, 0], [1, 0]])[:, 0])[0]
            for line in ax.lines:
                if line.get_gid() == "tube":
                    line.set_linewidth(diameter * per_metre * 72 / figure.dpi)
        _save(figure, path)


def landings(path: Path, trials: pd.DataFrame, methods: list[str]) -> None:
    """Landings against their prediction; ± 5 % is shaded."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(4.6, 5.2))
        trials = trials[trials.landing_y.notna() & trials.predicted_y.notna()]
        both = trials[["landing_y", "predicted_y"]].to_numpy()
        low, high = (0, 1) if both.size == 0 else (0.95 * both.min(), 1.05 * both.max())
        line = np.array([low, high])
        ax.fill_between(line, 0.95 * line, 1.05 * line, color="0.9", lw=0, label="± 5 %")
        ax.plot(line, line, color="0.6", lw=1)
        for number, method in enumerate(methods):
            mine = trials[trials.method == method]
            inside = mine.stretch <= mine.recorded_stretch
            for chosen, face, where in (
                (inside, color(number), "inside the recorded stretch"),
                (~inside, "none", "beyond it"),
            ):
                if chosen.any():
                    ax.scatter(
                        mine.landing_y[chosen], mine.predicted_y[chosen], s=22, facecolors=face,
                        edgecolors=color(number), label=f"{method}, {where}", alpha=0.8,
                    )  # fmt: skip
        kinds = " and ".join(sorted(set(trials.kind))) or "no"
        ax.set(xlabel=f"{kinds} landing [m]", ylabel="predicted landing [m]")
        ax.set(xlim=(low, high), ylim=(low, high), aspect="equal")
        figure.legend(loc="outside lower center", fontsize=8)
        _save(figure, path)


def convergence(path: Path, results: dict[str, Result]) -> None:
    """Best loss so far against rollouts; a tick where the refinement takes over."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(5.5, 3.4))
        for number, (method, result) in enumerate(results.items()):
            total = result.history.total.to_numpy(float)
            best = np.minimum.accumulate(np.where(np.isfinite(total), total, np.inf))
            rollouts = np.arange(1, len(best) + 1)
            ax.plot(rollouts, best, color=color(number), label=f"{method}: {best[-1]:.4g}")
            later = np.flatnonzero(result.history.phase.to_numpy() != result.history.phase.iloc[0])
            if later.size:
                ax.plot(rollouts[later[0]], best[later[0]], "o", ms=5, color=color(number))
        ax.set(xlabel="rollouts (dot: CMA-ES takes over)", ylabel="best loss so far")
        _log_axis(ax)
        ax.legend()
        _save(figure, path)


def training(path: Path, results: dict[str, Result]) -> None:
    """Landing error of the deterministic policy by iteration of PPO, in its own simulator."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(5.5, 3.4))
        for number, (method, result) in enumerate(results.items()):
            curve = result.training
            ax.plot(curve.iteration, 100 * curve.mean_error, color=color(number), label=method)
        ax.axhline(1, color="0.6", lw=1)
        ax.set(
            xlabel="PPO iteration (line: the aim of 1 cm)",
            ylabel="mean |landing − target| [cm]",
        )
        _log_axis(ax)
        ax.legend()
        _save(figure, path)


def landing_map(
    path: Path,
    result: Result,
    draws: np.ndarray,
    targets: np.ndarray,
    recorded: float,
    fork_width: float,
    rest_length: float,
) -> None:
    """Landing against draw, with the policy's path over its targets.

    Args:
        draws: The policy's draws [m] for `targets` [m], shape (N, 2).
        recorded: Largest stretch of the recording; what lies beyond is extrapolated.
    """
    chart: LandingMap = result.landing_map
    fine_y = np.linspace(chart.draw_y[0], chart.draw_y[-1], 161)
    fine_z = np.linspace(chart.draw_z[0], chart.draw_z[-1], 161)
    y, z = np.meshgrid(fine_y, fine_z, indexing="ij")
    points = np.stack([y.ravel(), z.ravel()], 1)
    landed = chart(points)
    stretch = stretch_of(np.insert(points, 0, 0, axis=1), fork_width, rest_length).reshape(y.shape)
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(6, 4.6))
        landing = landed.landing_y.reshape(y.shape)
        ax.set_facecolor("0.8")
        ax.grid(False)
        if np.isfinite(landing).any():
            filled = ax.contourf(y, z, landing, levels=24, cmap="viridis")
            figure.colorbar(filled, label="simulated landing [m] (grey: the launch fails)")
            lines = ax.contour(y, z, landing, levels=np.unique(targets), colors="w", linewidths=0.8)
            ax.clabel(lines, fmt="%g m", fontsize=7)
        if stretch.min() < recorded < stretch.max():
            ax.contour(y, z, stretch, levels=[recorded], colors="k", linestyles=":")
            ax.plot([], [], "k:", label=f"recorded stretch {recorded:.2f}: beyond is extrapolated")
        ax.plot(*draws.T, color=COLORS[0], lw=2.5, label="the policy's draws, near to far target")
        ax.plot(*draws[0], "o", color=COLORS[0])
        ax.set(xlabel="draw y [m]", ylabel="draw z [m]")
        ax.set(xlim=(fine_y[0], fine_y[-1]), ylim=(fine_z[0], fine_z[-1]))
        figure.legend(loc="outside lower center", ncols=2, fontsize=8)
        _save(figure, path)


def _log_axis(ax: plt.Axes) -> None:
    """Logarithmic y axis with plain numbers."""
    ax.set_yscale("log")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(LogFormatter(minor_thresholds=(1.5, 0.5)))


def _save(figure: plt.Figure, path: Path) -> None:
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=130, metadata={"Software": None})
    plt.close(figure)
