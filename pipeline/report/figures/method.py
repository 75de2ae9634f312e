"""Figure 2 of the paper: its search, on the loss as it is."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from pipeline.report.figures.panels import entitle
from pipeline.report.figures.search import BOXED, PATH, STAR, regions
from pipeline.report.landscape import AXES, Landscape
from pipeline.report.results import Result
from sling2sim2real.drawing.canvas import few_ticks, key, mark, picture
from sling2sim2real.drawing.styles import INK
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings.identification import ParameterBoxes

ROUND = (1, 2, 5), (1, 2, 3, 5, 7), (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)  # times 10^n
FEW = 4  # ticks, less than which are too few
SHOWN = 0.6  # share of the grid that the colour scale tells apart
LEVELS = 12


@picture(BOXED | {"figure.constrained_layout.use": True})
def method(result: Result, chart: Landscape, boxes: ParameterBoxes) -> Figure:
    """Three panels, one above the other: exploration, regions, CMA-ES."""
    evaluations, (x, y) = result.evaluations, AXES
    figure, axes = plt.subplots(3, 1, figsize=(5.2, 7.6), sharex=True, sharey=True)
    entitle(figure, f"How the search of the paper's loss goes ({result.band})")
    finite = chart.loss[np.isfinite(chart.loss)]
    least, most = finite.min(), np.quantile(finite, SHOWN)
    shades = ScalarMappable(LogNorm(least, max(most, 1.01 * least)), "viridis")
    levels = np.geomspace(least, max(most, 1.01 * least), LEVELS)
    titles = "1 exploration by DE", "2 the best regions, their covariances", "3 CMA-ES in each"
    best = evaluations.total.to_numpy(float).argmin()
    for step, (ax, title) in enumerate(zip(axes, titles, strict=True)):
        loss = np.ma.masked_invalid(chart.loss)
        style = {"levels": levels, "cmap": shades.cmap, "norm": shades.norm, "extend": "max"}
        ax.set_facecolor("0.85")
        ax.contourf(chart.x, chart.y, loss, **style)
        explored = evaluations.loc[evaluations.phase == "de"]
        failed = ~np.isfinite(explored.total)
        size = 10 if step == 0 else 3
        good = explored.loc[~failed]
        ax.scatter(good[f"unit_{x}"], good[f"unit_{y}"], s=size, color="w", ec=INK, lw=0.4)
        lost = explored.loc[failed]
        ax.plot(lost[f"unit_{x}"], lost[f"unit_{y}"], "x", ms=3.5, mew=0.7, color="0.45")
        if step:
            regions(ax, result, x, y, paths=step == 2)
        if step == 2:
            star = {"color": STAR, "mec": INK, "ms": 13, "mew": 0.8, "zorder": 6}
            ax.plot(evaluations[f"unit_{x}"][best], evaluations[f"unit_{y}"][best], "*", **star)
        ax.set(xlim=chart.x[[0, -1]], ylim=chart.y[[0, -1]], ylabel=QUANTITIES[y].heading)
        ax.set_yticks(*_ticks(y, boxes, chart.y))
        ax.set_title(title, fontsize=9, loc="left")
    axes[-1].set_xticks(*_ticks(x, boxes, chart.x))
    axes[-1].set(xlim=chart.x[[0, -1]], ylim=chart.y[[0, -1]], xlabel=QUANTITIES[x].heading)
    bar = figure.colorbar(shades, ax=axes, extend="max", label="geom + force + work", aspect=40)
    few_ticks(bar.ax.yaxis)
    dot = mark(ls="", marker="o", ms=4, color="w", mec=INK)
    entries = [
        ("θ that DE tried", dot),
        ("simulation failed", mark(ls="", marker="x", ms=4, color="0.45")),
        ("covariance, one deviation", mark(color=INK, lw=0.7)),
        ("mean of CMA-ES", mark(color=PATH, lw=0.9)),
        ("θ*", mark(ls="", marker="*", ms=11, color=STAR, mec=INK)),
    ]
    key(figure, entries, 2)
    return figure


def _ticks(name: str, boxes: ParameterBoxes, shown: np.ndarray) -> tuple[list[float], list[str]]:
    """Round values within a part of a logarithmic axis of the unit cube: places, and words."""
    box, factor = getattr(boxes, name), QUANTITIES[name].factor
    low, high = np.log10([box.low * factor, box.high * factor])
    decades = range(int(np.floor(low)), int(np.ceil(high)))
    ticks: list[tuple[float, str]] = []
    for numbers in ROUND:
        values = [number * 10.0**decade for decade in decades for number in numbers]
        places = ((np.log10(value) - low) / (high - low) for value in values)
        marked = zip(places, values, strict=True)
        ticks = [(at, f"{value:g}") for at, value in marked if shown[0] <= at <= shown[-1]]
        if len(ticks) >= FEW:
            break
    return [at for at, _ in ticks], [words for _, words in ticks]
