"""The recording beside the calibrated simulation: force, distance, work, clouds."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pipeline.episode.episode import Episode
from pipeline.episode.phases import phases, taut_frames
from pipeline.report.figures.canvas import save
from pipeline.report.replay import Replay
from pipeline.report.styles import INK, THEME, Styles

DASHES = ("-", (0, (4, 1.5)), (0, (1, 1)))  # so that curves that lie on each other are seen
AROUND = (-0.25, 0.5)  # of the release, magnified [s]
MOVED = 0.005  # after the release, by which the band is seen to have left the hand [s]
MOST_RECOIL = 3  # frames of the recoil that are shown


def force(path: Path, episode: Episode, replays: dict[str, Replay], styles: Styles) -> None:
    """Force over time, its residual, and the clouds' distance; the release magnified."""
    rows = ("force, y [N]", "force, z [N]", "|residual| [N]", "clouds off by [cm]")
    with plt.rc_context(THEME):
        figure, axes = plt.subplots(
            4, 2, figsize=(9.6, 7.4), width_ratios=(1.9, 1), height_ratios=(1.35, 1, 1, 1),
            sharex="col", sharey="row",
        )  # fmt: skip
        for ax in axes[:, 0], axes[:, 1]:
            for row, axis in ((0, 1), (1, 2)):
                ax[row].plot(episode.time, episode.force[:, axis], color=INK, lw=2)
            for number, (method, replay) in enumerate(replays.items()):
                style = {"color": styles[method].color, "lw": 1.3, "ls": DASHES[number % 3]}
                ax[0].plot(episode.time, replay.force[:, 1], **style)
                ax[1].plot(episode.time, replay.force[:, 2], **style)
                residual = np.linalg.norm(episode.force - replay.force, axis=1)
                style["lw"] = 1.1
                ax[2].plot(episode.time, residual, **style | {"ls": "-"})
                style |= {"ls": "", "marker": ".", "ms": 6 if number == 0 else 3.5}
                ax[3].plot(episode.cloud_time, 100 * replay.distance, **style)
            for one in ax:
                one.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
        for ax, label in zip(axes[:, 0], rows, strict=True):
            ax.set_ylabel(label)
        figure.align_ylabels(axes[:, 0])
        axes[3, 0].set(xlabel="time [s] (grey line: release)", xlim=episode.time[[0, -1]])
        axes[3, 1].set_xlabel("time around the release [s]")
        axes[3, 1].set_xlim(episode.release_time + AROUND[0], episode.release_time + AROUND[1])
        handles = [plt.Line2D([], [], color=INK, lw=2)]
        for number, method in enumerate(replays):
            style = {"color": styles[method].color, "lw": 1.3, "ls": DASHES[number % 3]}
            handles.append(plt.Line2D([], [], **style))
        names = ["measured", *(styles[method].name for method in replays)]
        figure.legend(handles, names, loc="outside lower center", ncols=len(names))
        save(figure, path)


def work(path: Path, episode: Episode, replays: dict[str, Replay], styles: Styles) -> None:
    """Work of the band on the hand since the start, measured and simulated, and the difference."""
    with plt.rc_context(THEME):
        figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.3), sharex=True)
        first = next(iter(replays.values()))
        left.plot(episode.time, first.measured_work, color=INK, lw=2, label="measured")
        for number, (method, replay) in enumerate(replays.items()):
            style = {"color": styles[method].color, "lw": 1.3, "ls": DASHES[number % 3]}
            left.plot(episode.time, replay.work, label=styles[method].name, **style)
            gap = replay.measured_work - replay.work
            right.plot(episode.time, gap, **style | {"ls": "-"})
            ending = {"ha": "left", "va": "center", "fontsize": 8, "color": styles[method].color}
            right.annotate(
                _signed(gap[-1], ".3f") + " J", (1, gap[-1]), xycoords=("axes fraction", "data"),
                xytext=(3, 0), textcoords="offset points", annotation_clip=False, **ending,
            )  # fmt: skip
        left.set_ylabel("work on the hand, ∫ f·v dt [J]")
        right.set_ylabel("measured − simulated [J]")
        for ax in (left, right):
            ax.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
            ax.set(xlabel="time [s] (grey line: release)", xlim=episode.time[[0, -1]])
        left.legend()
        save(figure, path)


def moments(episode: Episode) -> dict[str, int]:
    """Frames to look at: slack, held at full draw, the taut recoil, just past it, swinging."""
    stamps, release = episode.cloud_time, episode.release_time
    _, taken = phases(episode)["slack"]

    def nearest(time: float) -> int:
        return int(np.abs(stamps - time).argmin())

    taut = np.flatnonzero(taut_frames(episode))
    moving = taut[stamps[taut] > release + MOVED]
    recoil = moving if len(moving) else taut
    chosen = {
        "slack in the hand": nearest((episode.grasp_time + taken) / 2),
        "held at full draw": nearest(release - 0.2),
    }
    for number, frame in enumerate(recoil[:MOST_RECOIL], start=1):
        chosen["taut recoil" + (f", {number}" if len(recoil) > 1 else "")] = int(frame)
    past = np.flatnonzero(stamps > (stamps[taut[-1]] if len(taut) else release))
    if len(past):
        chosen["just past it"] = int(past[0])
    return chosen | {"swinging": nearest(min(release + 0.5, stamps[-1]))}


def clouds(
    path: Path,
    episode: Episode,
    replays: dict[str, Replay],
    styles: Styles,
    frames: dict[str, int],
    diameter: float,
) -> None:
    """Measured points and simulated bands at `frames`, from above and along y, at one scale."""
    views = (("from above", 1), ("along y", 2))
    seen = [episode.clouds[frame] for frame in frames.values() if len(episode.clouds[frame])]
    seen += [r.center_line[frame] for r in replays.values() for frame in frames.values()]
    low = np.min([points.min(0) for points in seen], axis=0) - 0.02
    high = np.max([points.max(0) for points in seen], axis=0) + 0.02
    wide, tall = high[0] - low[0], [high[up] - low[up] for _, up in views]
    inches = (11.0 - 1.2) / len(frames) / wide  # a metre
    with plt.rc_context(THEME):
        figure, axes = plt.subplots(
            2, len(frames), figsize=(11, inches * sum(tall) + 1.6), sharex=True, sharey="row",
            height_ratios=tall, squeeze=False,
        )  # fmt: skip
        for column, (name, frame) in enumerate(frames.items()):
            since = episode.cloud_time[frame] - episode.release_time
            axes[0, column].set_title(f"{name}\n{_signed(since, '.3f')} s", fontsize=9)
            points = episode.clouds[frame]
            for ax, (_, up) in zip(axes[:, column], views, strict=True):
                ax.plot(points[:, 0], points[:, up], ".", ms=1.5, color=INK, zorder=2.5)
                for method, replay in replays.items():
                    line, color = replay.center_line[frame][:, [0, up]].T, styles[method].color
                    ax.plot(*line, color=color, lw=1, zorder=3)
                    ax.plot(*line, color=color, alpha=0.25, zorder=2, gid="tube")
                ax.set_aspect("equal")
            for number, (method, replay) in enumerate(reversed(replays.items())):
                axes[0, column].text(
                    0.98, 0.02 + 0.05 * number, f"{100 * replay.distance[frame]:.2f} cm",
                    transform=axes[0, column].transAxes, ha="right", fontsize=8,
                    color=styles[method].color,
                )  # fmt: skip
            axes[1, column].set_xlabel("x [m]")
        for row, (view, up) in zip(axes, views, strict=True):
            row[0].set(xlim=(low[0], high[0]), ylim=(low[up], high[up]))
            row[0].set_ylabel(f"{'xyz'[up]} [m], {view}")
        dots = [plt.Line2D([], [], ls="", marker=".", color=INK)]
        lines = [plt.Line2D([], [], color=styles[method].color) for method in replays]
        names = ["measured points", *(styles[method].name for method in replays)]
        figure.legend(dots + lines, names, loc="outside lower center", ncols=4)
        figure.draw_without_rendering()  # the layout decides how many points a metre takes
        for ax in axes.flat:
            per_metre = np.diff(ax.transData.transform([[0, 0], [1, 0]])[:, 0])[0]
            for line in ax.lines:
                if line.get_gid() == "tube":
                    line.set_linewidth(diameter * per_metre * 72 / figure.dpi)
        save(figure, path)


def _signed(value: float, form: str) -> str:
    return f"{value:+{form}}".replace("-", "−")
