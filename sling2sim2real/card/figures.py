"""The card's still pictures. Black is what was measured, magenta what is simulated."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sling2sim2real.card.camera import Pictures
from sling2sim2real.card.camera_view import SIMULATED, CameraView
from sling2sim2real.card.inputs import Aims, CardInputs
from sling2sim2real.card.simulated import Simulated
from sling2sim2real.drawing.canvas import key, mark, picture
from sling2sim2real.drawing.styles import INK
from sling2sim2real.episode.episode import Episode

WIDTH = 6.4  # inches: words are read on a phone too
CUT = (520, 470)  # pixels of each camera picture
MOVED = 0.005  # s after the release: in a picture from then on the band has left the hand
MOST_SPAN = 1.5  # m of landings on which targets find room for their names
AROUND = (-0.3, 0.4)  # of the release, magnified [s]
TITLE = {"fontsize": 11, "fontweight": "bold"}
KINDS = {"measured": ("o", "measured"), "virtual": ("D", "virtual rig")}


def moments(episode: Episode, simulated: Simulated, pictures: Pictures) -> dict[str, int]:
    """Pictures to look at: hanging, drawn just before the release, in the recoil."""
    taken, release = pictures.time + simulated.camera, simulated.release
    hanging = pictures.latest(max(episode.grasp_time - 0.1, 0.0))
    drawn = pictures.latest(release - simulated.camera - 1e-3)
    recoil = min(int(np.searchsorted(taken, release + MOVED)), len(taken) - 1)
    before, after = 1000 * (release - taken[drawn]), 1000 * (taken[recoil] - release)
    return {
        "hanging": hanging,
        f"drawn, {before:.0f} ms before the release": drawn,
        f"recoil, {after:.0f} ms after the release": recoil,
    }


@picture(dpi=110)
def camera(episode: Episode, simulated: Simulated, pictures: Pictures) -> Figure:
    """Three camera pictures with the simulated band drawn in."""
    view = CameraView.of(pictures, simulated, CUT, begin=0.0)
    chosen = moments(episode, simulated, pictures)
    figure, axes = plt.subplots(2, 2, figsize=(7, 7))
    axes[0, 1].set_axis_off()  # two by two, so that a phone shows them large
    places = axes[0, 0], axes[1, 0], axes[1, 1]
    for ax, (name, number) in zip(places, chosen.items(), strict=True):
        image = view.picture(number)
        ax.imshow(image[..., ::-1], interpolation="antialiased")
        line = simulated.line(pictures.time[number] + simulated.camera)
        ax.plot(*view.places(line).T, color=SIMULATED, lw=1.1)
        ax.set_axis_off()
        ax.set_title(name, fontsize=10)
        ax.set(xlim=(-0.5, CUT[0] - 0.5), ylim=(CUT[1] - 0.5, -0.5))
    axes[0, 1].text(
        0.5,
        0.5,
        "Does the simulated\nband (magenta) lie\non the recorded one?",
        ha="center",
        va="center",
        **TITLE,
    )
    return figure


@picture(dpi=110)
def force(episode: Episode, simulated: Simulated) -> Figure:
    """Force on the gripper and what is left of it, over time, the release magnified."""
    figure, axes = plt.subplots(
        2, 2, figsize=(WIDTH, 4.6), width_ratios=(1.6, 1), height_ratios=(2, 1), sharex="col",
        sharey="row",
    )  # fmt: skip
    for top, bottom in axes.T:
        for rollouts, style in (
            (episode.force, {"color": INK, "lw": 2.4}),
            (simulated.force, {"color": SIMULATED, "lw": 1.2}),
        ):
            top.plot(episode.time, np.linalg.norm(rollouts, axis=1), **style)
        for axis, dashes in ((1, "-"), (2, ":")):
            gap = episode.force[:, axis] - simulated.force[:, axis]
            bottom.plot(episode.time, gap, color=INK, lw=1.1, ls=dashes)
        for ax in (top, bottom):
            ax.axvline(simulated.release, color="0.6", lw=0.8, zorder=0)
    axes[0, 0].set_ylabel("force on the hand [N]")
    axes[1, 0].set_ylabel("measured −\nsimulated [N]")
    axes[1, 0].set(xlabel="time [s], grey: release", xlim=episode.time[[0, -1]])
    around = np.add(simulated.release, AROUND)
    axes[1, 1].set(xlabel="around it [s]", xlim=around)
    figure.align_ylabels(axes[:, 0])
    figure.suptitle("Does the simulated force follow the measured one?", **TITLE)
    entries = {
        "measured": mark(color=INK, lw=2.4),
        "simulated": mark(color=SIMULATED),
        "residual y": mark(color=INK, lw=1.1),
        "residual z": mark(color=INK, lw=1.1, ls=":"),
    }
    key(figure, entries.items(), columns=2)
    return figure


@picture(dpi=110)
def landings(inputs: CardInputs) -> Figure:
    """Predicted landings with their intervals, and where launches landed."""
    aims, launched = inputs.aims, inputs.launched
    figure, ax = plt.subplots(figsize=(WIDTH, 3.8))
    entries = {}
    for kind, (marker, name) in KINDS.items():
        rows = launched.loc[launched.kind == kind]
        if not len(rows):
            continue
        x, off = rows.predicted_y.to_numpy(), (rows.landing_y - rows.predicted_y).to_numpy()
        bars = (rows[["predicted_low", "predicted_high"]].to_numpy().T - x) * 100
        unaimed = ~np.isclose(x[:, None], aims.landing, atol=1e-6).any(axis=1)
        _bars(ax, x[unaimed], bars[:, unaimed], color="0.75", lw=3)
        if unaimed.any():
            entries["90 % interval of other draws"] = mark(color="0.75", lw=3)
        style = {"marker": marker, "ms": 5, "mfc": "none", "mec": INK, "ls": ""}
        ax.plot(x, 100 * off, **style, zorder=4)
        entries[f"landed ({name})"] = mark(**style)
    _aimed(ax, aims)
    entries["predicted, with its 90 % interval"] = mark(color=SIMULATED, lw=3, marker="o", ms=5)
    ax.axhline(0, color="0.6", lw=0.8, zorder=0)
    ax.set(xlabel="predicted landing [m]", ylabel="landing − predicted [cm]")
    question = "Do launches land inside the predicted intervals?"
    alone = "Where should launches land?\nPredicted by the simulator; nothing was measured"
    figure.suptitle(question if len(launched) else alone, **TITLE)
    key(figure, entries.items(), columns=2)
    return figure


def _aimed(ax: Axes, aims: Aims) -> None:
    bars = (aims.interval.T - aims.landing) * 100
    _bars(ax, aims.landing, bars, color=SIMULATED, lw=6, alpha=0.35)
    ax.plot(aims.landing, 0 * aims.landing, "o", color=SIMULATED, ms=5, zorder=3)
    ax.margins(x=0.12, y=0.15)
    crowded = np.ptp(ax.get_xlim()) > MOST_SPAN
    below = ax.get_xaxis_transform()  # along the axis, where no launch lies over the words
    for x, target, high in zip(aims.landing, aims.target, bars[1], strict=True):
        if np.isfinite(x + high) and not crowded:
            words = {"ha": "center", "fontsize": 8, "color": SIMULATED}
            ax.text(x, 0.02, f"target {target:g} m", transform=below, **words)


def _bars(ax: Axes, x: np.ndarray, ends: np.ndarray, **style) -> None:
    """Vertical bars at x (N,) from and to ends (2, N)."""
    good = np.isfinite(ends).all(axis=0)
    ax.vlines(x[good], *ends[:, good], zorder=2, **style)
