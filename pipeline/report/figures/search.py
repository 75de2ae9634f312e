"""Figure 2 of the paper: how its search goes, on the loss itself."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from pipeline.report.data import Result, Run
from pipeline.report.figures.panels import entitle
from sling2sim2real.drawing.canvas import few_ticks, key, mark, picture
from sling2sim2real.drawing.styles import INK
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.identification.objective.loss import EpisodeLoss
from sling2sim2real.identification.results.ranges import SearchedRange
from sling2sim2real.identification.results.theta import calibrated, parameters_of
from sling2sim2real.identification.searches.regions import Region
from sling2sim2real.quantities import QUANTITIES

AXES = "youngs_modulus", "elasticity_damping"  # two dominant factors, the paper says
SIZE = 17  # rollouts along each axis
AROUND = 0.04  # of the unit cube, about what is shown
PATH, STAR = "#e4003a", "#ffd23f"
SHOWN = 0.6  # share of the grid that the colour scale tells apart
LEVELS = 12
FRAMED = dict.fromkeys(["axes.spines.top", "axes.spines.right"], True) | {"axes.grid": False}


@dataclass(frozen=True)
class Landscape:
    """The paper's loss on a grid of the unit cube through θ*: what its search finds its way on.

    Attributes:
        x, y: Places along AXES, shape (SIZE,) each.
        loss: +inf where the simulation fails, shape (SIZE, SIZE), y first.
    """

    x: np.ndarray
    y: np.ndarray
    loss: np.ndarray


def landscape(run: Run, result: Result) -> Landscape:
    """Around the regions of a search and where CMA-ES went from them."""
    params, episode = run.params, run.episodes[result.band]
    box = SearchBox.of_method(params, result.method)
    sling = calibrated(params, result.band, result.theta, run.layout.clamps(result.pair))
    best = box.unit_of(parameters_of(result.theta))[0]
    x, y = (_span(result, name) for name in AXES)
    grid = np.tile(best, (SIZE * SIZE, 1))
    places = [box.names.index(name) for name in AXES]
    grid[:, places] = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    evaluate = Evaluator(episode, sling, EpisodeLoss.of(params, result.method, episode, sling), box)
    return Landscape(x, y, evaluate(grid).total.reshape(SIZE, SIZE))


def _span(result: Result, name: str) -> np.ndarray:
    refined = result.evaluations.loc[result.evaluations.phase == "cma", f"unit_{name}"]
    axis = result.axes.index(name)
    centres = [region.mu[axis] for region in result.regions]
    best = result.evaluations[f"unit_{name}"][result.evaluations.total.argmin()]
    low, high = np.quantile(refined, [0.02, 0.98])
    low, high = min([low, best, *centres]) - AROUND, max([high, best, *centres]) + AROUND
    return np.linspace(max(low, 0), min(high, 1), SIZE)


@picture(FRAMED)
def search(result: Result, chart: Landscape, ranges: dict[str, SearchedRange]) -> Figure:
    """Three panels, one above the other: exploration, regions, CMA-ES.

    Args:
        ranges: Of the search, by name.
    """
    figure, axes = plt.subplots(3, 1, figsize=(5.2, 7.6), sharex=True, sharey=True)
    entitle(figure, f"How the search of the paper's loss goes ({result.band})")
    finite = chart.loss[np.isfinite(chart.loss)]
    least = finite.min()
    most = max(np.quantile(finite, SHOWN), 1.01 * least)
    shades = ScalarMappable(LogNorm(least, most), "viridis")
    quantities = [QUANTITIES[name] for name in AXES]

    def physical(places: np.ndarray) -> list[np.ndarray]:
        """Values along AXES of places (N, 2) in the unit cube, in the units of the axes."""
        sides = zip(quantities, np.transpose(places), strict=True)
        return [axis.factor * ranges[axis.name].at(side) for axis, side in sides]

    evaluations = result.evaluations
    places = evaluations[[f"unit_{name}" for name in AXES]].to_numpy()
    explored, failed = evaluations.phase == "de", ~np.isfinite(evaluations.total)
    x, y = physical(np.stack([chart.x, chart.y], axis=1))
    titles = "1 exploration by DE", "2 the best regions, their covariances", "3 CMA-ES in each"
    for step, (ax, title) in enumerate(zip(axes, titles, strict=True)):
        ax.set_facecolor("0.85")
        ax.contourf(
            x, y, np.ma.masked_invalid(chart.loss), extend="max", cmap=shades.cmap,
            norm=shades.norm, levels=np.geomspace(least, most, LEVELS),
        )  # fmt: skip
        size = 10 if step == 0 else 3
        ax.scatter(*physical(places[explored & ~failed]), s=size, color="w", ec=INK, lw=0.4)
        ax.plot(*physical(places[explored & failed]), "x", ms=3.5, mew=0.7, color="0.45")
        for number, region in enumerate(result.regions if step else ()):
            ellipse, way = around(result, number, region)
            ax.plot(*physical(ellipse), color=INK, lw=0.7, zorder=4)
            if step == 2:
                ax.plot(*physical(way), color=PATH, lw=0.9, zorder=5)
            centre = [float(side[0]) for side in physical(way[:1])]
            ax.plot(*centre, "o", ms=7.5, color="w", mec=INK, mew=0.7, zorder=5)
            text = {"ha": "center", "va": "center_baseline", "fontsize": 6, "zorder": 5.5}
            ax.text(*centre, str(number + 1), **text)
        if step == 2:
            star = {"color": STAR, "mec": INK, "ms": 13, "mew": 0.8, "zorder": 6}
            ax.plot(*physical(places[[evaluations.total.argmin()]]), "*", **star)
        ax.set(xscale=ranges[AXES[0]].scale, yscale=ranges[AXES[1]].scale)
        ax.set(xlim=x[[0, -1]], ylim=y[[0, -1]], ylabel=quantities[1].heading)
        ax.set_title(title, fontsize=9, loc="left")
        few_ticks(ax.yaxis)
    few_ticks(axes[-1].xaxis)
    axes[-1].set_xlabel(quantities[0].heading)
    bar = figure.colorbar(shades, ax=axes, extend="max", label="geom + force + work", aspect=40)
    few_ticks(bar.ax.yaxis)
    entries = [
        ("θ that DE tried", mark(ls="", marker="o", ms=4, color="w", mec=INK)),
        ("simulation failed", mark(ls="", marker="x", ms=4, color="0.45")),
        ("covariance, one deviation", mark(color=INK, lw=0.7)),
        ("mean of CMA-ES", mark(color=PATH, lw=0.9)),
        ("θ*", mark(ls="", marker="*", ms=11, color=STAR, mec=INK)),
    ]
    key(figure, entries, 2)
    return figure


def around(result: Result, number: int, region: Region) -> tuple[np.ndarray, np.ndarray]:
    """A region's covariance at one deviation, and its centre with the mean of its CMA-ES.

    Points of the unit cube along AXES, shape (N, 2); one of the second an iteration.
    """
    index = [result.axes.index(name) for name in AXES]
    turn = np.linspace(0, 2 * np.pi, 61)
    spread = np.linalg.cholesky(region.sigma[np.ix_(index, index)])
    ellipse = region.mu[index] + np.stack([np.cos(turn), np.sin(turn)], axis=1) @ spread.T
    mine = result.evaluations.query("phase == 'cma' and solver == @number")
    way = mine[[f"unit_{name}" for name in AXES]].groupby(mine.generation).mean()
    return ellipse, np.vstack([region.mu[index], np.asarray(way)])
