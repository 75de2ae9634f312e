"""One picture of a recording: six moments with mask and cloud, the force, the coverage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from sling2sim2real.base.files import replacing
from sling2sim2real.cli.preflight.check import Look
from sling2sim2real.cli.preflight.facts import Facts
from sling2sim2real.cli.preflight.report import verdict_of
from sling2sim2real.drawing.names import as_label
from sling2sim2real.drawing.styles import COLORS, INK, THEME
from sling2sim2real.recording import images
from sling2sim2real.recording.build import Whole
from sling2sim2real.recording.clouds import PictureLine, masker
from sling2sim2real.recording.scene import RgbdFrame, Scene
from sling2sim2real.recording.streams import Recording
from sling2sim2real.settings import Settings
from sling2sim2real.settings.recording import CloudParams

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOMENTS = ("hanging", "grasp", "lift", "mid pull", "held", "recoil")
SIZE, DPI = (16.0, 12.0), 100  # inches, dots an inch
MASK = (255, 0, 255)  # BGR
DIM = 0.55  # of what is no band
ROOM = 0.06  # m around the scene


def draw_sheet(look: Look, params: Settings, path: Path) -> str:
    """Write a PNG, 1600 pixels wide, of what can be shown.

    Returns:
        What was drawn, in words.
    """
    import matplotlib.pyplot as plt
    from matplotlib.style import context

    if look.recording is None:
        return f"{path} was not drawn: nothing in the recording can be shown"
    with context(THEME):
        figure = plt.figure(figsize=SIZE if look.done else (16, 6.5), dpi=DPI)
        if look.done:
            _whole(figure, look.done, look.report["signals"], params)
        else:
            _raw(figure, look.recording)
        verdict = verdict_of(look.report).removesuffix(", but:")
        title = as_label(f"{Path(look.report['path']).name}: {verdict}")
        figure.suptitle(title, fontsize=12, wrap=True)
        with replacing(path) as temporary:
            figure.savefig(temporary, format="png", metadata={"Software": None})
        plt.close(figure)
    if look.done:
        return f"{path}: six moments, force, coverage"
    return f"{path}: pictures and raw force, all that can be shown"


def masked_frames(
    done: Whole, cloud: CloudParams, numbers: list[int] | None = None
) -> Iterator[tuple[RgbdFrame, np.ndarray]]:
    """These or all pictures of the window with their masks, by the backend of params.cloud."""
    mask = masker(cloud.mask, done.view)
    for _, frame in done.view.frames(numbers):
        yield frame, mask.mask(frame)


def moments(scene: Scene) -> dict[str, float]:
    """Times to look at, by MOMENTS: seconds since the window's start."""
    signals = scene.signals
    grasp, release = signals.grasp_time, signals.release_time
    times = np.linspace(grasp, release, 500)[:-1]
    taut = [time for time in times if scene.taut(time)] or [grasp + 0.7 * (release - grasp)]
    stretch = np.array([scene.stretch(time) for time in taut])
    half = taut[int(np.argmax(stretch >= (stretch[0] + stretch.max()) / 2))]
    when = (0.4 * grasp, grasp + 0.1, (grasp + taut[0]) / 2, half, release - 0.2, release + 0.03)
    return dict(zip(MOMENTS, when, strict=True))


def _seen(done: Whole, params: Settings) -> Iterator[tuple[str, RgbdFrame, np.ndarray, np.ndarray]]:
    """Name, picture, mask (H, W) and cloud (P, 3) of each moment."""
    times = done.clouds.time  # of the pictures that could be decoded
    when = moments(done.scene)
    which = [int(np.argmin(np.abs(times - time))) for time in when.values()]
    numbers = [int(np.argmin(np.abs(done.view.times - times[k]))) for k in which]
    frames = masked_frames(done, params.cloud, numbers)
    for name, k, (frame, mask) in zip(when, which, frames, strict=True):
        yield name, frame, mask, done.clouds.points[k]


def _whole(figure: Figure, done: Whole, facts: Facts, params: Settings) -> None:
    from sling2sim2real.drawing.canvas import key, mark  # imports Matplotlib

    start = facts["window_start_s"]
    grid = figure.add_gridspec(5, len(MOMENTS), height_ratios=[0.88, 0.55, 0.92, 1.0, 0.55])
    for column, (name, frame, mask, points) in enumerate(_seen(done, params)):
        axes = figure.add_subplot(grid[0, column])
        axes.imshow(cv2.cvtColor(_overlaid(frame.color, mask), cv2.COLOR_BGR2RGB))
        axes.set_title(f"{name}, {start + frame.time:.3f} s")
        axes.set_axis_off()
        for row, (a, b) in enumerate(((1, 2), (0, 1)), start=1):
            axes = figure.add_subplot(grid[row, column])
            _cloud(axes, done, frame.time, points, a, b, labels=column == 0)
    force = figure.add_subplot(grid[3, :])
    _force(force, done, facts)
    covered = figure.add_subplot(grid[4, :], sharex=force)
    _coverage(covered, done.coverage)
    _events(covered, done, facts)
    key(
        figure,
        [
            ("mask of the band", mark(color=np.array(MASK[::-1]) / 255)),
            ("points of the band", mark(ls="", marker=".", color=COLORS[1])),
            ("tips of the fork", mark(ls="", marker="^", color=INK)),
            ("hand", mark(ls="", marker="s", color=COLORS[2], mec=INK)),
            ("from tip to hand, while the band is taut", mark(color=COLORS[0])),
            ("fork", mark(color="0.7", lw=2)),
        ],
    )


def _overlaid(color: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The picture, dimmed but for the band, whose outline is drawn."""
    shown = np.where(mask[..., None], (color + np.array(MASK)) / 2, DIM * color).astype(np.uint8)
    outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    large = cv2.resize(shown, None, fx=3, fy=3, interpolation=cv2.INTER_LINEAR)
    outlines = [3 * outline + 1 for outline in outlines]
    return cv2.drawContours(large, outlines, -1, MASK, 1)


def _cloud(
    axes: Axes, done: Whole, time: float, points: np.ndarray, a: int, b: int, labels: bool
) -> None:
    """Draw points (P, 3) and what is known around them along two axes of frame O."""
    scene, hand = done.scene, done.signals.hand(time)
    axes.scatter(points[:, a], points[:, b], s=1.5, color=COLORS[1], linewidths=0)
    for tip in scene.tips:
        if scene.taut(time):
            axes.plot([tip[a], hand[a]], [tip[b], hand[b]], color=COLORS[0], lw=0.8)
        if b == 2:
            axes.plot([tip[a]] * 2, [scene.floor, tip[b]], color="0.7", lw=2, zorder=0)
    axes.plot(*scene.tips[:, [a, b]].T, "^", color=INK, ms=5)
    axes.plot(hand[a], hand[b], "s", color=COLORS[2], ms=6, mec=INK, mew=0.6)
    path = done.signals.path[done.signals.path_time < done.signals.release_time]
    corners = np.vstack([scene.tips, path, [[0, 0.1, -scene.rest_length / 2]]])
    low, high = corners.min(axis=0) - ROOM, corners.max(axis=0) + ROOM
    axes.set(xlim=(low[a], high[a]), ylim=(low[b], high[b]), aspect="equal")
    if labels:
        axes.set(xlabel=f"{'xyz'[a]} [m]", ylabel=f"{'xyz'[b]} [m]")
    else:
        axes.tick_params(labelbottom=False, labelleft=False)


def _force(axes: Axes, done: Whole, facts: Facts) -> None:
    """Draw each component of the force and its size: seconds since the recording's first force."""
    signals, start = done.signals, facts["window_start_s"]
    time = start + signals.time
    for axis, values, color in zip("xyz", signals.force.T, COLORS, strict=False):
        axes.plot(time, values, color=color, lw=1.2, label=f"$F_{axis}$")
    size = np.linalg.norm(signals.force, axis=1)
    axes.plot(time, size, color=INK, lw=0.8, ls=":", label="size")
    _events(axes, done, facts, named=True)
    axes.set(ylabel="force on the hand [N]", xlim=(start, time[-1]))
    axes.legend(loc="upper left", bbox_to_anchor=(0.11, 0.95))


def _coverage(axes: Axes, rows: list[PictureLine]) -> None:
    time = [row.time for row in rows]
    axes.plot(time, [row.coverage for row in rows], color=COLORS[1], lw=1.2)
    axes.set(ylabel="band covered", ylim=(0, 1.05), xlabel="time since the first force [s]")


def _events(axes: Axes, done: Whole, facts: Facts, named: bool = False) -> None:
    for name, time in (("grasp", facts["grasp_s"]), ("release", facts["release_s"])):
        axes.axvline(time, color=INK, lw=0.8, ls="--")
        if not named:
            continue
        axes.annotate(
            f"{name} {time:.3f} s",
            (time, 1.01),
            xycoords=("data", "axes fraction"),
            va="bottom",
            ha="center",
        )
    start = facts["window_start_s"]
    for time in moments(done.scene).values():
        axes.plot(start + time, 0, "|", color=INK, ms=8, transform=axes.get_xaxis_transform())


def _raw(figure: Figure, recording: Recording) -> None:
    """Six pictures and the raw force of a recording that cannot be used."""
    grid = figure.add_gridspec(2, len(MOMENTS), height_ratios=[1.0, 1.1])
    origin = recording.origin
    numbers = np.linspace(0, len(recording.color.values) - 1, len(MOMENTS)).round().astype(int)
    for column, number in enumerate(numbers):
        axes = figure.add_subplot(grid[0, column])
        axes.set_axis_off()
        axes.set_title(f"{recording.color.seconds(origin)[number]:.3f} s")
        try:
            picture = images.color(recording.color.values[number])
        except images.Undecodable:
            axes.text(0.5, 0.5, "cannot be decoded", ha="center")
            continue
        axes.imshow(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
    axes = figure.add_subplot(grid[1, :])
    for axis, values, color in zip("xyz", recording.wrench.values.T, COLORS, strict=False):
        axes.plot(
            recording.wrench.seconds(origin), values, color=color, lw=0.8, label=f"$F_{axis}$"
        )
    axes.set(xlabel="time since the first force [s]", ylabel="raw force [N]")
    axes.legend(ncols=3)
