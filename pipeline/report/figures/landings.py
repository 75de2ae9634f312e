"""Launches of every band and method: beside their targets, and in flight."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from pipeline.report.figures.panels import explain, panels
from pipeline.report.tables import BULLSEYE
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.drawing.canvas import mark, patch, picture
from sling2sim2real.drawing.styles import INK, Styles
from sling2sim2real.launching.flight import flight
from sling2sim2real.settings.lab import SetupParams

LINEAR = 10  # cm, beyond which an axis is logarithmic
TICKS = (-100, -30, -10, -5, 0, 5, 10, 30, 100)
MARKS = ("v", "o", "^", "s", "D", "P")  # of targets, near to far
ROOM = 0.32  # of a row, that launches take to either side
SHADE = "0.88"
LEAVES = "leave_y", "leave_z", "speed", "angle"  # columns of a predicted flight
DOT = {"ls": "", "marker": "o", "ms": 4, "color": "0.4"}


@picture()
def misses(trials: pd.DataFrame, floors: dict[str, float], styles: Styles) -> Figure:
    """How far from its target each launch landed, a panel a band and a row a method.

    Args:
        trials: Launches with a target, as data.py has them.
        floors: By band, the mean error of an oracle's launches [m].
        styles: Of the methods to be shown.
    """
    trials = trials.assign(cm=100 * trials.miss)
    targets = dict(zip(sorted({*trials.target}), MARKS, strict=False))
    places = np.linspace(-ROOM, ROOM, len(targets)) if len(targets) > 1 else [0.0]
    title = "Nearer to the line is better: every launch, beside its target"
    tall, bands = 0.3 * len(styles) + 0.6, dict.fromkeys(trials.band)
    figure, axes = panels(bands, title, tall, columns=1, sharex=True, sharey=True)
    most = max(LINEAR, 1.1 * float(np.nanmax(trials.cm.abs(), initial=0)))
    for band, ax in axes.items():
        ax.axvline(0, color=INK, lw=0.8, zorder=1)
        ax.set_yticks(range(len(styles)), [style.name for style in styles.values()])
        ax.set_xscale("symlog", linthresh=LINEAR)
        ax.set(xlim=(-most, most), ylim=(len(styles) - 0.5, -0.6))
        ax.xaxis.set_major_locator(FixedLocator(TICKS))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter("{x:g}")
        for label, style in zip(ax.get_yticklabels(), styles.values(), strict=False):
            label.set_color(style.color)
        floor = 100 * floors.get(band, 0)
        ax.axvspan(-floor, floor, color=SHADE, lw=0)
        for row, (method, style) in enumerate(styles.items()):
            mine = trials.loc[(trials.band == band) & (trials.method == method)]
            heights = dict(zip(targets, row + np.array(places), strict=True))
            for (target, source), dots in mine.dropna(subset="cm").groupby(["target", "source"]):
                face = "none" if source == "measured" else style.color
                ax.scatter(
                    dots.cm, [heights[target]] * len(dots), s=18, marker=targets[target],
                    facecolors=face, edgecolors=style.color, alpha=0.8, zorder=3,
                )  # fmt: skip
            if failed := int(mine.cm.isna().sum()):
                left = mine.cm.mean() > 0  # where no dot lies
                words = {"ha": "left" if left else "right", "va": "center", "color": style.color}
                where = {"transform": ax.get_yaxis_transform(), "fontsize": 7}
                text = f"{failed} of {len(mine)} failed"
                ax.text(0.01 if left else 0.99, row, text, **words, **where)
    beyond = f", logarithmic beyond ± {LINEAR}" * (most > LINEAR)
    [*axes.values()][-1].set_xlabel(f"landing − target [cm]{beyond}")
    entries: list[tuple[str, Artist]] = [
        (f"aimed at {target:g} m", mark(**DOT | {"marker": marker, "ms": 6}))
        for target, marker in targets.items()
    ]
    if floors:
        entries.append(("actuation floor: errors of draw and release alone", patch(SHADE)))
    if "measured" in {*trials.source}:
        entries.append(("measured (hollow)", mark(**DOT, mfc="none")))
    explain(figure, entries)
    return figure


@picture()
def flights(trials: pd.DataFrame, setup: SetupParams, styles: Styles) -> Figure:
    """Figure 4 of the paper, from the side: a panel a method, every virtual launch of a band.

    The recording's camera looks at the band, so that no flight is in its pictures.

    Args:
        trials: Of one band, as data.py has them.
        styles: Of the methods that are shown.
    """
    names = [style.name for style in styles.values()]
    title = "Flights of the launches, and as each method's simulator expected them"
    figure, axes = panels(names, title, 1.2, sharex=True, sharey=True)
    floor = -setup.fork_height
    for ax, (method, style) in zip(axes.values(), styles.items(), strict=True):
        ax.plot(TARGET_AREA, [floor] * 2, color="0.8", lw=5, solid_capstyle="butt", zorder=0)
        for target in trials.target.dropna().unique():
            ends = target - BULLSEYE, target + BULLSEYE
            ax.plot(ends, [floor] * 2, "|-", color=INK, lw=0.8, zorder=1)
        ax.plot([0, 0], [floor, 0], color="0.35", lw=2)
        mine = trials.loc[trials.method == method]
        for trial in mine.to_dict("records"):
            if trial["flight_y"] is not None:
                ax.plot(trial["flight_y"], trial["flight_z"], color=style.color, lw=0.9, alpha=0.8)
            if np.isfinite(trial["predicted_speed"]):
                y, z, speed, angle = (trial[f"predicted_{name}"] for name in LEAVES)
                way = flight(y, z, speed, angle, floor)
                ax.plot(*way, color=INK, lw=0.6, ls="--", zorder=1)
        if (flown := mine.flight_y.notna().sum()) < len(mine):
            ax.set_title(f"{style.name} ({flown} of {len(mine)} flew)", fontsize=9)
        ax.set(aspect="equal", xlabel="y [m]")
        ax.label_outer()
    next(iter(axes.values())).set_ylabel("z [m]")
    entries = [
        ("launched on the rig", mark(color="0.4", lw=1.2)),
        ("expected", mark(color=INK, lw=0.8, ls="--")),
        (f"within {100 * BULLSEYE:.0f} cm of a target", mark(color=INK, lw=0.8, marker="|")),
        ("target area", mark(color="0.8", lw=5)),
    ]
    explain(figure, entries)
    return figure
