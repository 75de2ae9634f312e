"""What the searches evaluated: convergence, and the history in the unit cube."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.colors import LogNorm
from matplotlib.patches import Ellipse

from pipeline.drawing.canvas import PARAMETERS, few_ticks, key, log_y, mark, picture
from pipeline.drawing.styles import INK, SIDE_BY_SIDE, Styles, drawn
from pipeline.report.results import Result, best_so_far, printed
from pipeline.sling.material import THETA

PATH, STAR = "#e4003a", "#ffd23f"
NEAR = 0.3  # of the least loss, the part that is magnified
EDGE = 0.02
BOXED = dict.fromkeys(["axes.spines.top", "axes.spines.right"], True)
BOXED |= dict.fromkeys(["axes.grid", "figure.constrained_layout.use"], False)
SHOWN = 0.9  # share of the evaluated points that the colour scale tells apart


@picture()
def convergence(results: dict[str, Result], styles: Styles, own) -> plt.Figure:
    """The printed loss of every method's best so far, against rollouts.

    Args:
        own: Methods that minimise another loss than the printed one: their curves may rise.
    """
    least = min(printed(result.history).min() for result in results.values())
    first = drawn(results, SIDE_BY_SIDE)  # on top where curves lie on each other
    figure, axes = plt.subplots(1, 2, figsize=(10.5, 4.2))
    for method, result in results.items():
        common = printed(result.history)
        best = common[best_so_far(result.history)]
        best = np.where(np.isfinite(best), best, np.nan)
        rollouts = np.arange(1, len(best) + 1)
        style = {"color": styles[method].color, "ls": "--" if method in own else "-"}
        style |= {"lw": 1.6, "zorder": 3} if method in first else {"lw": 1.0, "zorder": 2}
        label = f"{styles[method].name}: {best[-1]:.3f}"
        later = np.flatnonzero(result.history.phase.to_numpy() == "cma")[:1]
        for ax in axes:
            ax.plot(rollouts, best, drawstyle="steps-post", label=label, **style)
            ax.plot(rollouts[later], best[later], "o", ms=5, color=style["color"])
            ax.set_xlabel("rollouts (dot: CMA-ES takes over)")
    axes[0].set_ylabel("printed loss of the best so far")
    log_y(axes[0])
    axes[1].set_ylim(least * (1 - NEAR / 15), least * (1 + NEAR))
    axes[1].set_title("the same near the least", fontsize=9)
    curves, names = axes[0].get_legend_handles_labels()
    order = np.argsort([line.get_ydata()[-1] for line in curves], kind="stable")
    entries = [(names[i], curves[i]) for i in order]
    key(figure, entries + [("dashed: has another loss", mark(color="0.5", ls="--"))] * bool(own), 4)
    return figure


@picture(BOXED, dpi=100)
def corner(result: Result, boxes, title: str) -> plt.Figure:
    """Every evaluated point in the unit cube, each pair of free parameters against each other.

    Args:
        boxes: params.yaml's `parameters`: low, high and scale of each axis.
        title: Whose search it is.
    """
    history = result.history
    unit = {n[5:]: history[n].to_numpy(float) for n in history if n.startswith("unit_")}
    free = [name for name, values in unit.items() if np.ptp(values) > 0] or list(unit)
    size = len(free)
    total = history.total.to_numpy(float)
    good = np.flatnonzero(np.isfinite(total))
    good = good[np.argsort(-total[good], kind="stable")]  # the best on top
    failed = ~np.isfinite(total)
    best = int(np.argmin(np.where(failed, np.inf, total)))
    worst = max(np.quantile(total[good], SHOWN), 1.001 * total[best])
    color = {"c": total[good], "cmap": "viridis", "norm": LogNorm(total[best], worst)}
    sizes = np.where(history.phase.to_numpy()[good] == "cma", 5, 14)
    star = {"color": STAR, "mec": INK}
    inches = 1.4 + 1.55 * max(size, 3)
    figure, axes = plt.subplots(size, size, figsize=(inches, inches), squeeze=False)
    figure.subplots_adjust(0.08, 0.07, 0.93, 0.98, wspace=0.08, hspace=0.08)
    for (row, column), ax in np.ndenumerate(axes):
        if column > row:
            ax.remove()
            continue
        x = free[column]
        if row == column:
            points = ax.scatter(unit[x][good], total[good], s=sizes, lw=0, **color)
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
            _regions(ax, result, x, y)
            ax.plot(unit[x][best], unit[y][best], "*", ms=12, mew=0.8, zorder=6, **star)
            ax.set(ylim=(0, 1))
            ax.set_yticks(*_ticks(y, boxes, history), fontsize=7)
        ax.set(xlim=(0, 1))
        ax.set_xticks(*_ticks(x, boxes, history), fontsize=7)
        if row == size - 1:
            ax.set_xlabel(_label(x))
        else:
            ax.tick_params(labelbottom=False)
        if column == 0 and row > 0:
            ax.set_ylabel(_label(free[row]))
        elif row != column:
            ax.tick_params(labelleft=False)
    side = figure.add_axes((0.62, 0.93, 0.31, 0.016))
    bar = figure.colorbar(points, cax=side, orientation="horizontal", extend="max")
    bar.set_label(f"loss of {title}")
    few_ticks(bar.ax.xaxis)
    bar.ax.tick_params(which="both", labelsize=7)
    _key(figure, result, failed.any())
    return figure


def _regions(ax: plt.Axes, result: Result, x: str, y: str) -> None:
    """Centres of the regions, their covariances at one deviation, and the paths of CMA-ES."""
    refined = result.history[result.history.phase == "cma"]
    searched = {x, y} <= set(result.axes)
    for number, region in enumerate(result.regions if searched else ()):
        index = [result.axes.index(x), result.axes.index(y)]
        centre, sigma = region.mu[index], region.sigma[np.ix_(index, index)]
        spread, turn = np.linalg.eigh(sigma)
        angle = np.degrees(np.arctan2(turn[1, 1], turn[0, 1]))
        tall, wide = 2 * np.sqrt(spread)
        ax.add_patch(Ellipse(centre, wide, tall, angle=angle, fill=False, ec=INK, lw=0.7, zorder=4))
        mine = refined[refined.solver == number]
        way = mine.groupby("generation")[[f"unit_{x}", f"unit_{y}"]].mean().to_numpy()
        ax.plot(*np.vstack([centre, way]).T, color=PATH, lw=0.9, zorder=5)
        ax.plot(*centre, "o", ms=7.5, color="w", mec=INK, mew=0.7, zorder=5)
        text = {"ha": "center", "va": "center_baseline", "fontsize": 6}
        ax.text(*centre, str(number + 1), zorder=5.5, **text)


def _key(figure: plt.Figure, result: Result, failures: bool) -> None:
    """Legend in the empty corner."""
    entries = [("evaluated by the exploration", mark(ls="", marker="o", ms=4, color="0.4"))]
    if (result.history.phase == "cma").any():
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
    key(figure, entries, 1, loc="upper right", bbox_to_anchor=(0.95, 0.87), fontsize=8)


def _label(name: str) -> str:
    return PARAMETERS.get(name, (name.replace("_", " "), 1.0))[0]


def _ticks(name: str, boxes, history: pd.DataFrame) -> tuple[list[float], list[str]]:
    """Places in the unit cube of round physical values, and those values in words."""
    unit, value = history[f"unit_{name}"], history[name] * PARAMETERS.get(name, ("", 1.0))[1]
    log = name in THETA and getattr(boxes, name).scale == "log"
    scaled = np.log10(value) if log else value
    first, last = int(unit.argmin()), int(unit.argmax())
    slope = (scaled[last] - scaled[first]) / (unit[last] - unit[first] or 1.0)
    low = scaled[first] - slope * unit[first]
    high = low + slope
    if log:
        marks = np.arange(np.ceil(low), high)
    else:
        marks = plt.MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    place = (marks - low) / (slope or 1.0)
    seen = (place > EDGE) & (place < 1 - EDGE)  # those at an edge would meet the neighbours'
    words = [f"{10**mark if log else mark:g}" for mark in marks[seen]]
    return place[seen].tolist(), words
