"""Landings of every band and method: beside their target, and beside their predictions."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from pipeline.report.figures.panels import explain, panels
from pipeline.report.noise import landed
from sling2sim2real.drawing.canvas import mark, patch, picture
from sling2sim2real.drawing.styles import INK, Styles

FAIR = 5  # % of the distance, shaded
LINEAR = 10  # cm or %, beyond which an axis is logarithmic
TICKS = (-100, -30, -10, -5, 0, 5, 10, 30, 100)
MARKS = ("v", "o", "^", "s", "D", "P")  # of targets, near to far
ROOM = 0.32  # of a row, that launches take to either side
SHADE = "0.88"


@picture()
def misses(trials: pd.DataFrame, floors: dict[str, float], styles: Styles) -> Figure:
    """How far from its target each launch landed, a panel a band and a row a method.

    Args:
        trials: Launches with a target.
        floors: By band, the mean error of an oracle's launches [m].
        styles: Of the methods to be shown.
    """
    off = 100 * (trials.landing_y - trials.target)
    trials = trials.assign(off=off.where(landed(trials)))
    targets = dict(zip(sorted(set(trials.target)), MARKS, strict=False))
    title = "Nearer to the line is better: every launch, beside its target"
    figure, axes, beyond = _rows(trials, styles, title, trials.off)
    for band, ax in axes.items():
        floor = 100 * floors.get(band, 0)
        ax.axvspan(-floor, floor, color=SHADE, lw=0)
        for row, method in enumerate(styles):
            mine = trials.loc[(trials.band == band) & (trials.method == method)]
            color = styles[method].color
            for number, (target, sign) in enumerate(targets.items()):
                height = row + _spread(len(targets))[number]
                some = mine.loc[(mine.target == target) & mine.off.notna()]
                for kind, dots in some.groupby("kind"):
                    face = "none" if kind == "measured" else color
                    style = {"marker": sign, "s": 18, "facecolors": face, "edgecolors": color}
                    ax.scatter(dots.off, [height] * len(dots), alpha=0.8, zorder=3, **style)
            if failed := int(mine.off.isna().sum()):
                left = mine.off.mean() > 0  # where no dot lies
                words = {"ha": "left" if left else "right", "va": "center", "color": color}
                where = {"transform": ax.get_yaxis_transform(), "fontsize": 7}
                text = f"{failed} of {len(mine)} failed"
                ax.text(0.01 if left else 0.99, row, text, **words, **where)
    [*axes.values()][-1].set_xlabel(f"landing − target [cm]{beyond}")
    dot = {"ls": "", "color": "0.4"}
    entries: list[tuple[str, Artist]] = [
        (f"aimed at {t:g} m", mark(**dot, marker=m)) for t, m in targets.items()
    ]
    if floors:
        entries.append(("actuation floor: errors of draw and release alone", patch(SHADE)))
    if "measured" in set(trials.kind):
        entries.append(("measured (hollow)", mark(**dot, marker="o", mfc="none")))
    explain(figure, entries)
    return figure


@picture()
def predictions(trials: pd.DataFrame, trusted: Collection, styles: Styles) -> Figure:
    """How far each predicted landing is from the actual one, with its interval.

    Args:
        trials: Launches, landed or not.
        trusted: Pairs of band and method whose intervals hold what is known of θ; those of others
            hold the draw's error alone.
        styles: Of the methods to be shown.
    """
    trials = trials.loc[trials.landing_y.notna() & trials.predicted_y.notna()]
    off, low, high = (
        100 * (trials[f"predicted_{name}"] / trials.landing_y - 1) for name in ("y", "low", "high")
    )
    trials = trials.assign(off=off, low=low, high=high).reset_index(drop=True)
    inside = trials.stretch <= trials.recorded_stretch
    title = "A good prediction lies at zero, in a short interval that holds zero"
    figure, axes, beyond = _rows(trials, styles, title, off)
    trials = trials.sort_values(["target", "landing_y"])
    for band, ax in axes.items():
        ax.axvspan(-FAIR, FAIR, color=SHADE, lw=0)
        for row, method in enumerate(styles):
            mine = trials.loc[(trials.band == band) & (trials.method == method)]
            height, color = row + _spread(len(mine)), styles[method].color
            line = "-" if (band, method) in trusted else (0, (1, 1))
            ax.hlines(height, mine.low, mine.high, color=color, lw=0.9, ls=line, zorder=2)
            face = np.where(inside[mine.index], color, "none")
            ax.scatter(mine.off, height, s=9, facecolors=face, edgecolors=color, lw=0.7, zorder=3)
    [*axes.values()][-1].set_xlabel(f"predicted / landed − 1 [%]{beyond}")
    dot = {"ls": "", "marker": "o", "ms": 4, "color": "0.4"}
    entries = [("a launch", mark(**dot))]
    if not inside.all():
        entries.append(("stretched beyond the recording", mark(**dot, mfc="none")))
    ranged = trials.loc[trials.predicted_low.notna()]
    pairs = set(zip(ranged.band, ranged.method, strict=True))
    if pairs & {*trusted}:
        entries.append(("90 % interval", mark(color="0.4", lw=1)))
    if pairs - {*trusted}:
        entries.append(("90 % by the draw's error alone", mark(color="0.4", lw=1, ls=(0, (1, 1)))))
    explain(figure, [*entries, (f"± {FAIR} %", patch(SHADE))])
    return figure


def _rows(trials: pd.DataFrame, styles: Styles, title: str, off: pd.Series):
    """A panel a band with a row a method, an axis that reaches as far as `off`, and its label."""
    bands = dict.fromkeys(trials.band)
    tall = 0.3 * len(styles) + 0.6
    figure, axes = panels(bands or [""], title, tall, columns=1, sharex=True, sharey=True)
    most = max(LINEAR, 1.1 * float(np.nanmax(off.abs(), initial=0)))
    for ax in axes.values():
        ax.axvline(0, color=INK, lw=0.8, zorder=1)
        ax.set_yticks(range(len(styles)), [style.name for style in styles.values()])
        ax.set_ylim(len(styles) - 0.5, -0.6)
        ax.set_xscale("symlog", linthresh=LINEAR)
        ax.set_xlim(-most, most)
        ax.xaxis.set_major_locator(FixedLocator(TICKS))
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_formatter("{x:g}")
        for label, style in zip(ax.get_yticklabels(), styles.values(), strict=False):
            label.set_color(style.color)
    return figure, axes, f", logarithmic beyond ± {LINEAR}" * (most > LINEAR)


def _spread(count: int) -> np.ndarray:
    """Places of so many launches about the middle of a row."""
    return np.linspace(-ROOM, ROOM, count) if count > 1 else np.zeros(count)
