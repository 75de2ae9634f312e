"""What the searches evaluated: convergence, and where in the unit cube."""

from __future__ import annotations

from itertools import cycle

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.ticker import MaxNLocator

from pipeline.report.figures.panels import entitle, explain, panels
from pipeline.report.figures.policy import DASHES
from pipeline.report.results import Result, best_so_far, printed
from sling2sim2real.drawing.canvas import few_ticks, key, log_y, mark, picture
from sling2sim2real.drawing.styles import INK, Styles
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings.identification import ParameterBoxes
from sling2sim2real.simulator.parameters import THETA

PATH, STAR = "#e4003a", "#ffd23f"
NEAR = 0.5  # above the least loss, up to which a picture reaches at least
EDGE = 0.02
BOXED = dict.fromkeys(["axes.spines.top", "axes.spines.right"], True)
BOXED |= dict.fromkeys(["axes.grid", "figure.constrained_layout.use"], False)
SHOWN = 0.9  # share of the evaluated points that the colour scale tells apart


@picture()
def convergence(searches: dict[str, dict[str, Result]], styles: Styles) -> Figure:
    """The printed loss of every method's best so far, against rollouts.

    Args:
        searches: By band and method. A method that minimises another loss may rise.
    """
    title = "Lower is a better fit, further left a cheaper one: the paper's loss so far"
    figure, axes_of = panels(searches, title, 2.4, sharex=True)
    methods = dict.fromkeys(method for of_band in searches.values() for method in of_band)
    dashes = dict(zip(methods, cycle(DASHES)))
    for band, ax in axes_of.items():
        ends = []
        for method, result in searches[band].items():
            common = printed(result.evaluations)
            best = common[best_so_far(result.evaluations)]
            best = np.where(np.isfinite(best), best, np.nan)
            style = {"color": styles[method].color, "ls": dashes[method], "lw": 1.3}
            ax.plot(rollouts(result), best, drawstyle="steps-post", **style)
            ax.plot(rollouts(result)[-1], best[-1], "o", ms=4, color=style["color"])
            ends.append(best[-1])
        least = np.nanmin(ends)
        ax.set_ylim(0.97 * least, max((1 + NEAR) * least, 1.03 * np.nanmax(ends)))
        ax.set_xlabel("rollouts")
        log_y(ax)
    next(iter(axes_of.values())).set_ylabel("geom + force + work")
    entries = [(styles[m].name, mark(color=styles[m].color, ls=dashes[m])) for m in methods]
    explain(figure, entries)
    return figure


def rollouts(result: Result) -> np.ndarray:
    """How many rollouts the search had spent at each of its evaluations, shape (N,).

    A fit keeps one row of all that it spends.
    """
    spent = np.arange(1, len(result.evaluations) + 1)
    spent[-1] = max(spent[-1], result.theta.get("rollouts", 0))
    return spent


@picture(BOXED, dpi=100)
def corner(result: Result, boxes: ParameterBoxes, title: str) -> Figure:
    """Every evaluated point in the unit cube, each pair of free parameters against each other.

    Args:
        boxes: params.yaml's `parameters`: low, high and scale of each axis.
        title: Whose search it is.
    """
    evaluations = result.evaluations
    unit = {n[5:]: evaluations[n].to_numpy(float) for n in evaluations if n.startswith("unit_")}
    free = [name for name, values in unit.items() if np.ptp(values) > 0] or list(unit)
    size = len(free)
    total = evaluations.total.to_numpy(float)
    good = np.flatnonzero(np.isfinite(total))
    good = good[np.argsort(-total[good], kind="stable")]  # the best on top
    failed = ~np.isfinite(total)
    best = int(np.argmin(np.where(failed, np.inf, total)))
    worst = max(np.quantile(total[good], SHOWN), 1.001 * total[best])
    shades = ScalarMappable(LogNorm(total[best], worst), "viridis")
    color = {"c": total[good], "cmap": shades.cmap, "norm": shades.norm}
    sizes = np.where(evaluations.phase.to_numpy()[good] == "cma", 5, 14)
    star = {"color": STAR, "mec": INK}
    inches = 1.4 + 1.55 * max(size, 3)
    figure, axes = plt.subplots(size, size, figsize=(inches, inches), squeeze=False)
    entitle(figure, "Every point that the search tried: dark is good, the star is the best")
    figure.subplots_adjust(0.08, 0.07, 0.93, 0.95, wspace=0.08, hspace=0.08)
    for (row, column), ax in np.ndenumerate(axes):
        if column > row:
            ax.remove()
            continue
        x = free[column]
        if row == column:
            ax.scatter(unit[x][good], total[good], s=sizes, lw=0, **color)
            ax.axvline(unit[x][best], color=PATH, lw=0.8)
            ax.set(yscale="log", ylim=(0.98 * total[best], 1.3 * worst), ylabel="loss")
            few_ticks(ax.yaxis)
            ax.yaxis.tick_right()
            ax.yaxis.set_label_position("right")
            ax.tick_params(axis="y", which="both", labelsize=6)
        else:
            y = free[row]
            ax.plot(unit[x][failed], unit[y][failed], "x", ms=3, mew=0.6, color="0.6")
            ax.scatter(unit[x][good], unit[y][good], s=sizes, lw=0, **color)
            regions(ax, result, x, y)
            ax.plot(unit[x][best], unit[y][best], "*", ms=12, mew=0.8, zorder=6, **star)
            ax.set(ylim=(0, 1))
            ax.set_yticks(*_ticks(y, boxes, evaluations), fontsize=7)
        ax.set(xlim=(0, 1))
        ax.set_xticks(*_ticks(x, boxes, evaluations), fontsize=7)
        if row == size - 1:
            ax.set_xlabel(QUANTITIES[x].heading)
        else:
            ax.tick_params(labelbottom=False)
        if column == 0 and row > 0:
            ax.set_ylabel(QUANTITIES[free[row]].heading)
        elif row != column:
            ax.tick_params(labelleft=False)
    side = figure.add_axes((0.62, 0.9, 0.31, 0.016))
    bar = figure.colorbar(shades, cax=side, orientation="horizontal", extend="max")
    bar.set_label(f"loss of {title}")
    few_ticks(bar.ax.xaxis)
    bar.ax.tick_params(which="both", labelsize=7)
    _key(figure, result, failed.any())
    return figure


def regions(ax: Axes, result: Result, x: str, y: str, paths: bool = True) -> None:
    """Centres of the regions, their covariances at one deviation, and the paths of CMA-ES."""
    refined = result.evaluations.loc[result.evaluations.phase == "cma"]
    searched = {x, y} <= set(result.axes)
    for number, region in enumerate(result.regions if searched else ()):
        index = [result.axes.index(x), result.axes.index(y)]
        across, up = centre = region.mu[index]
        spread, turn = np.linalg.eigh(region.sigma[np.ix_(index, index)])
        angle = np.degrees(np.arctan2(turn[1, 1], turn[0, 1]))
        tall, wide = 2 * np.sqrt(spread)
        line = {"fill": False, "ec": INK, "lw": 0.7, "zorder": 4}
        ax.add_patch(Ellipse((across, up), wide, tall, angle=angle, **line))
        mine = refined.loc[refined.solver == number]
        way = mine.groupby("generation")[[f"unit_{x}", f"unit_{y}"]].mean().to_numpy()
        if paths:
            ax.plot(*np.vstack([centre, way]).T, color=PATH, lw=0.9, zorder=5)
        ax.plot(across, up, "o", ms=7.5, color="w", mec=INK, mew=0.7, zorder=5)
        text = {"ha": "center", "va": "center_baseline", "fontsize": 6}
        ax.text(across, up, str(number + 1), zorder=5.5, **text)


def _key(figure: Figure, result: Result, failures: bool) -> None:
    """Legend in the empty corner."""
    entries = [("evaluated by the exploration", mark(ls="", marker="o", ms=4, color="0.4"))]
    if (result.evaluations.phase == "cma").any():
        entries.append(("evaluated by CMA-ES", mark(ls="", marker="o", ms=2, color="0.4")))
    if failures:
        entries.append(("simulation failed", mark(ls="", marker="x", ms=4, color="0.6")))
    if result.regions:
        dot = mark(ls="", marker="o", ms=7, color="w", mec=INK)
        entries += [
            ("centre of a region, best first", dot),
            ("its covariance, one deviation", mark(color=INK, lw=0.7)),
            ("mean of its CMA-ES by iteration", mark(color=PATH, lw=0.9)),
        ]
    entries.append(("θ*, the best of all", mark(ls="", marker="*", ms=11, color=STAR, mec=INK)))
    key(figure, entries, 1, loc="upper right", bbox_to_anchor=(0.95, 0.84), fontsize=8)


def _ticks(
    name: str, boxes: ParameterBoxes, evaluations: pd.DataFrame
) -> tuple[list[float], list[str]]:
    """Places in the unit cube of round physical values, and those values in words."""
    unit, value = (evaluations[column].to_numpy(float) for column in (f"unit_{name}", name))
    value = value * QUANTITIES[name].factor
    log = name in THETA and getattr(boxes, name).scale == "log"
    scaled = np.log10(value) if log else value
    first, last = int(unit.argmin()), int(unit.argmax())
    slope = (scaled[last] - scaled[first]) / (unit[last] - unit[first] or 1.0)
    low = scaled[first] - slope * unit[first]
    high = low + slope
    if log:
        marks = np.arange(np.ceil(low), high)
    else:
        marks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    place = (marks - low) / (slope or 1.0)
    seen = (place > EDGE) & (place < 1 - EDGE)  # those at an edge would meet the neighbours'
    words = [f"{10**mark if log else mark:g}" for mark in marks[seen]]
    return place[seen].tolist(), words
