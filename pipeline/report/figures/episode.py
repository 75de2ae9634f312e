"""The recording beside the calibrated simulation: force, work, clouds, the band under load."""

from __future__ import annotations

from collections.abc import Iterable

import matplotlib.pyplot as plt
import numpy as np

from pipeline.drawing.canvas import key, mark, picture
from pipeline.drawing.replay import LOAD, Replay
from pipeline.drawing.styles import INK, Style, Styles
from pipeline.episode.episode import Episode
from pipeline.episode.phases import phases, taut_frames

DASHES = ("-", (0, (4, 1.5)), (0, (1, 1)))  # so that curves that lie on each other are seen
AROUND = (-0.25, 0.5)  # of the release, magnified [s]
MOVED = 0.005  # after the release, by which the band is seen to have left the hand [s]
MOST_RECOIL = 3  # frames of the recoil that are shown
LOADED = 1.5  # width
SLACK, MARGIN = 0.05, 0.04  # of the peak force, below which the band is slack; of its draw [m]


@picture()
def force(episode: Episode, replays: dict[str, Replay], styles: Styles) -> plt.Figure:
    """Force over time, its residual, and the clouds' distance; the release magnified."""
    labels = ("force, y [N]", "force, z [N]", "|residual| [N]", "clouds off by [cm]")
    figure, axes = plt.subplots(
        4, 2, figsize=(9.6, 7.4), width_ratios=(1.9, 1), height_ratios=(1.35, 1, 1, 1),
        sharex="col", sharey="row",
    )  # fmt: skip
    for ax in axes.T:
        for axis in (1, 2):
            ax[axis - 1].plot(episode.time, episode.force[:, axis], color=INK, lw=2)
        for number, (method, replay) in enumerate(replays.items()):
            style = curve(styles[method], number)
            for axis in (1, 2):
                ax[axis - 1].plot(episode.time, replay.force[:, axis], **style)
            residual = np.linalg.norm(episode.force - replay.force, axis=1)
            ax[2].plot(episode.time, residual, **style | {"lw": 1.1, "ls": "-"})
            dots = style | {"ls": "", "marker": ".", "ms": 6 if number == 0 else 3.5}
            ax[3].plot(episode.cloud_time, 100 * replay.distance, **dots)
        for one in ax:
            one.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
    for ax, label in zip(axes[:, 0], labels, strict=True):
        ax.set_ylabel(label)
    figure.align_ylabels(axes[:, 0])
    axes[3, 0].set(xlabel="time [s] (grey line: release)", xlim=episode.time[[0, -1]])
    around = np.add(episode.release_time, AROUND)
    axes[3, 1].set(xlabel="time around the release [s]", xlim=around)
    key(figure, [("measured", mark(color=INK, lw=2)), *_curves(replays, styles)])
    return figure


def _curves(methods: Iterable[str], styles: Styles, *width: float) -> list[tuple[str, plt.Line2D]]:
    """What the curves of methods are, for a key."""
    return [(styles[m].name, mark(**curve(styles[m], n, *width))) for n, m in enumerate(methods)]


@picture()
def work(episode: Episode, replays: dict[str, Replay], styles: Styles) -> plt.Figure:
    """Work of the band on the hand since the start, measured and simulated, and the difference."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.3), sharex=True)
    first = next(iter(replays.values()))
    left.plot(episode.time, first.measured_work, color=INK, lw=2, label="measured")
    for number, (method, replay) in enumerate(replays.items()):
        style = curve(styles[method], number)
        left.plot(episode.time, replay.work, label=styles[method].name, **style)
        gap = replay.measured_work - replay.work
        right.plot(episode.time, gap, **style | {"ls": "-"})
        ending = {"ha": "left", "va": "center", "fontsize": 8, "color": styles[method].color}
        right.annotate(
            _signed(gap[-1]) + " J", (1, gap[-1]), xycoords=("axes fraction", "data"),
            xytext=(3, 0), textcoords="offset points", annotation_clip=False, **ending,
        )  # fmt: skip
    left.set_ylabel("work on the hand, ∫ f·v dt [J]")
    right.set_ylabel("measured − simulated [J]")
    for ax in (left, right):
        ax.axvline(episode.release_time, color="0.6", lw=0.8, zorder=0)
        ax.set(xlabel="time [s] (grey line: release)", xlim=episode.time[[0, -1]])
    left.legend()
    return figure


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


@picture()
def clouds(
    episode: Episode,
    replays: dict[str, Replay],
    styles: Styles,
    frames: dict[str, int],
    diameter: float,
) -> plt.Figure:
    """Measured points and simulated bands at `frames`, from above and along y, at one scale."""
    views = (("from above", 1), ("along y", 2))
    seen = [episode.clouds[frame] for frame in frames.values() if len(episode.clouds[frame])]
    seen += [r.center_line[frame] for r in replays.values() for frame in frames.values()]
    low = np.min([points.min(0) for points in seen], axis=0) - 0.02
    high = np.max([points.max(0) for points in seen], axis=0) + 0.02
    wide, tall = high[0] - low[0], [high[up] - low[up] for _, up in views]
    inches = (11.0 - 1.2) / len(frames) / wide  # a metre
    figure, axes = plt.subplots(
        2, len(frames), figsize=(11, inches * sum(tall) + 1.6), sharex=True, sharey="row",
        height_ratios=tall, squeeze=False,
    )  # fmt: skip
    for column, (name, frame) in enumerate(frames.items()):
        since = episode.cloud_time[frame] - episode.release_time
        top, points = axes[0, column], episode.clouds[frame]
        top.set_title(f"{name}\n{_signed(since)} s", fontsize=9)
        for ax, (_, up) in zip(axes[:, column], views, strict=True):
            ax.plot(points[:, 0], points[:, up], ".", ms=1.5, color=INK, zorder=2.5)
            for method, replay in replays.items():
                line, color = replay.center_line[frame][:, [0, up]].T, styles[method].color
                ax.plot(*line, color=color, lw=1, zorder=3)
                ax.plot(*line, color=color, alpha=0.25, zorder=2, gid="tube")
            ax.set_aspect("equal")
        for number, (method, replay) in enumerate(reversed(replays.items())):
            off, words = f"{100 * replay.distance[frame]:.2f} cm", {"ha": "right", "fontsize": 8}
            words |= {"transform": top.transAxes, "color": styles[method].color}
            top.text(0.98, 0.02 + 0.05 * number, off, **words)
        axes[1, column].set_xlabel("x [m]")
    for row, (view, up) in zip(axes, views, strict=True):
        row[0].set(xlim=(low[0], high[0]), ylim=(low[up], high[up]))
        row[0].set_ylabel(f"{'xyz'[up]} [m], {view}")
    lines = [(styles[method].name, mark(color=styles[method].color)) for method in replays]
    key(figure, [("measured points", mark(ls="", marker=".", color=INK)), *lines], 4)
    figure.draw_without_rendering()  # the layout decides how many points a metre takes
    for ax in axes.flat:
        per_metre = np.diff(ax.transData.transform([[0, 0], [1, 0]])[:, 0])[0]
        for line in ax.lines:
            if line.get_gid() == "tube":
                line.set_linewidth(diameter * per_metre * 72 / figure.dpi)
    return figure


@picture()
def loaded(
    episodes: dict[str, Episode],
    replays: dict[str, dict[str, Replay]],
    styles: Styles,
    fork_width: float,
    fork_height: float,
) -> plt.Figure:
    """A column a band: simulated bands under `LOAD`, to scale, and force against draw.

    Args:
        replays: By band and method.
    """
    shapes = [one.loaded for of_band in replays.values() for one in of_band.values()]
    deepest = np.nanmin([np.nanmin(shape[:, 2], initial=-0.1) for shape in shapes])
    low, half = min(deepest, -fork_height) - 0.05, fork_width / 2 + 0.06
    columns = len(replays)
    wide = min(4.2, 13.0 / columns)
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
    methods = dict.fromkeys(method for of_band in replays.values() for method in of_band)
    curves = _curves(methods, styles, LOADED)
    key(figure, [("measured (the pull alone)", mark(color=INK, lw=2)), *curves], 3)
    return figure


def _hanging(ax, replays: dict[str, Replay], styles, fork_width: float, fork_height: float) -> None:
    for side in (-1, 1):
        ax.plot([side * fork_width / 2] * 2, [0, -fork_height], color="0.6", lw=3, zorder=1)
    for number, (method, replay) in enumerate(replays.items()):
        style, shape = curve(styles[method], number, LOADED), replay.loaded
        depth = -shape[len(shape) // 2, 2]
        if np.isfinite(depth):
            ax.plot(shape[:, 0], shape[:, 2], **style, zorder=3)
            ax.plot(0, -depth, "o", ms=7, color=style["color"], mec="w", mew=0.7, zorder=4)
        said = f"{100 * depth:.1f} cm" if np.isfinite(depth) else "not found"
        words = {"ha": "right", "va": "top", "fontsize": 8, "color": style["color"]}
        ax.text(0.99, 0.97 - 0.055 * number, said, transform=ax.transAxes, **words)


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
        ax.plot(draw, size, **curve(styles[method], number, LOADED), zorder=3)


def curve(style: Style, number: int, width: float = 1.3) -> dict:
    """How the curve of the n-th method is drawn."""
    return {"color": style.color, "lw": width, "ls": DASHES[number % len(DASHES)]}


def _signed(value: float) -> str:
    return f"{value:+.3f}".replace("-", "−")
