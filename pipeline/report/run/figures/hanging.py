"""Figure 3 of the paper: how far the bands hang with its weight, by the calibrated simulators."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from pipeline.base.weight import WEIGHT
from pipeline.report.drawing.canvas import key, mark, picture
from pipeline.report.drawing.styles import INK, Styles
from pipeline.report.run.figures.panels import entitle
from pipeline.report.run.tables.evaluation import Hanging

BETWEEN = 1.6  # columns from a band to the next
FOLDED = 2  # strands


@picture()
def hanging(rows: list[Hanging], styles: Styles) -> Figure:
    """A folded band a line, hung from the top: grey is its length without the weight."""
    figure, ax = plt.subplots(figsize=(5.6, 3.6))
    entitle(figure, f"Bands that hang folded, with {WEIGHT:g} kg: lengths by each simulator")
    place, middles, last = 0.0, {}, None
    for row in rows:
        place += 1 if row.band == last else BETWEEN
        last = row.band
        middles.setdefault(row.band, []).append(place)
        color = INK if row.method is None else styles[row.method].color
        length = 100 * row.lengths[FOLDED]
        if np.isfinite(length):
            ax.plot([place, place], [0, length], color=color, lw=3)
            ax.plot(place, length, "s", color=color, ms=9)
            ax.text(place, length + 2.2, f"{length:.0f}", ha="center", va="top", fontsize=8)
        ax.plot([place, place], [0, 100 * row.rest], color="0.8", lw=1.2)
    for band, places in middles.items():
        stretch = next(row for row in rows if row.band == band)
        ends = places[0] - 0.5, places[-1] + 0.5
        ax.hlines(100 * stretch.rest * stretch.recorded, *ends, color="0.5", lw=0.8, ls=":")
    ax.set_xticks([np.mean(places) for places in middles.values()], list(middles))
    ax.xaxis.tick_top()
    ax.tick_params(axis="x", length=0)
    ax.grid(axis="x", visible=False)
    ax.set(ylabel="length below the clamp [cm]")
    ax.set_ylim(1.14 * np.nanmax([100 * row.lengths[FOLDED] for row in rows]), 0)
    shown = dict.fromkeys(row.method for row in rows)
    entries = [
        ("the rig's rubber" if method is None else styles[method].name,
         mark(color=INK if method is None else styles[method].color, lw=3))
        for method in shown
    ]  # fmt: skip
    entries += [("without the weight", mark(color="0.8", lw=1.2))]
    entries += [("recorded stretch", mark(color="0.5", lw=0.8, ls=":"))]
    key(figure, entries, 2)
    return figure
