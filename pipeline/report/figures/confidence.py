"""How far θ* is to be trusted: profile curves with marginals, and correlations."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import chi2

from pipeline.report.figures.canvas import PARAMETERS, few_ticks, key, mark, patch, picture
from pipeline.report.results import Result
from pipeline.report.styles import INK, Styles
from pipeline.sling.material import THETA

BINS = 14  # of a marginal, over the span that is shown
TOP = 3.0  # of the misfit axis, in units of the misfit at the interval's ends


@picture()
def profiles(results: dict[str, Result], styles: Styles, boxes) -> plt.Figure:
    """Least misfit with one parameter held at each value, and the posterior's marginals.

    Args:
        results: Methods whose θ has a confidence.
        boxes: params.yaml's `parameters`.
    """
    level = next(iter(results.values())).confidence["level"]
    reach = float(chi2.ppf(level, 1))
    figure, axes = plt.subplots(2, 3, figsize=(9.6, 5.6), sharey=True)
    for ax, name in zip(axes.flat, THETA, strict=False):
        label, unit = PARAMETERS[name]
        box, marks = getattr(boxes, name), []
        log = box.scale == "log"
        ax.set(xlabel=label, xscale="log" if log else "linear")
        for number, (method, result) in enumerate(results.items()):
            about = result.confidence["parameters"][name]
            color, best = styles[method].color, result.theta["theta"][name]
            if about.get("fixed"):
                ax.axvline(unit * best, color=color, lw=1.2, ls=":")
                marks.append(f"{styles[method].name}: held fixed")
                continue
            _marginal(ax, unit * _column(result, name), color, reach, log=log)
            curve = result.posterior["profiles"][name]
            value = unit * np.array(curve["value"])
            ax.plot(value, curve["misfit"], "o-", ms=2.5, color=color, lw=1.5)
            _interval(ax, about, unit, best, color, number, reach)
            if not about["identifiable"]:
                marks.append(f"{styles[method].name}: not identifiable")
        if log:
            few_ticks(ax.xaxis)
        else:  # the whole box, so that an interval that fills it is seen to
            margin = 0.03 * (box.high - box.low)
            ax.set_xlim(unit * (box.low - margin), unit * (box.high + margin))
        ax.axhline(reach, color="0.5", lw=0.8, ls="--")
        words = {"va": "top", "fontsize": 7.5, "zorder": 6}
        ax.text(0.03, 0.98, "\n".join(marks), transform=ax.transAxes, **words)
    _product(axes[1, 2], results, styles, reach)
    axes[0, 0].set_ylim(0, TOP * reach)
    for ax in axes[:, 0]:
        ax.set_ylabel("misfit above its least")
    entries = [(styles[method].name, mark(color=styles[method].color)) for method in results]
    entries += [
        (f"{100 * level:g} % of a likelihood ratio", mark(color="0.5", ls="--", lw=0.8)),
        (f"{100 * level:g} % interval and θ*", mark(color="0.4", lw=3)),
        ("posterior's marginal", patch("0.8")),
    ]
    key(figure, entries)
    return figure


def _product(ax: plt.Axes, results: dict[str, Result], styles, reach: float) -> None:
    """Marginal of s·d, the damping that a recording can see."""
    for number, (method, result) in enumerate(results.items()):
        about, color = result.confidence["derived"].get("damping_product"), styles[method].color
        if about is not None:
            samples = _column(result, "damping_scale") * _column(result, "elasticity_damping")
            _marginal(ax, 1e3 * samples, color, reach, log=False)
            theta = result.theta["theta"]
            best = theta["damping_scale"] * theta["elasticity_damping"]
            _interval(ax, about, 1e3, best, color, number, reach)
    ax.set_xlabel("s·d [ms] (marginal alone)")


def _column(result: Result, name: str) -> np.ndarray:
    """Samples of a parameter, SI units, shape (S,)."""
    samples = np.array(result.posterior["samples"], float)
    return samples[:, result.posterior["names"].index(name)]


def _marginal(ax: plt.Axes, samples: np.ndarray, color: str, reach: float, *, log: bool) -> None:
    """Histogram whose highest bin reaches two thirds of the panel."""
    scaled = np.log(samples) if log else samples
    edges = np.histogram_bin_edges(scaled, BINS)
    counts, edges = np.histogram(scaled, edges)
    edges = np.exp(edges) if log else edges
    ax.stairs(counts / counts.max() * TOP * reach * 2 / 3, edges, fill=True, color=color, alpha=0.2)


def _interval(ax, about: dict, unit: float, best, color: str, number: int, reach: float) -> None:
    """A bar near the top of the panel, one line a method, with a dot at θ*; SI times `unit`."""
    height = (0.80 - 0.06 * number) * TOP * reach
    ends = unit * about["low"], unit * about["high"]
    ax.plot(ends, [height, height], color=color, lw=3, solid_capstyle="butt")
    ax.plot(unit * best, height, "o", ms=6, color=color, mec="w", mew=1)


@picture({"axes.grid": False})
def correlation(results: dict[str, Result], styles: Styles) -> plt.Figure:
    """Correlations of the posterior, a matrix a method."""
    cells = max(len(one.confidence["correlation"]["names"]) for one in results.values())
    inches = max(3.4, 0.47 * cells)
    size = (len(results) * (inches + 0.9) + 0.7, inches + 0.8)
    figure, axes = plt.subplots(1, len(results), figsize=size, squeeze=False)
    for ax, (method, result) in zip(axes.flat, results.items(), strict=True):
        about = result.confidence["correlation"]
        matrix = np.array(about["matrix"], float)
        names = [quantity(name) for name in about["names"]]
        image = ax.imshow(matrix, cmap="RdBu_r", vmin=-1, vmax=1)
        for (row, column), value in np.ndenumerate(matrix):
            small = "1" if row == column else "0"
            shown = abs(value) >= 0.005 and row != column
            text = f"{value:+.2f}".replace("-", "−") if shown else small
            ink = {"color": "w" if abs(value) > 0.6 else INK, "fontsize": 7}
            ax.text(column, row, text, ha="center", va="center", **ink)
        ax.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
        ax.set_yticks(range(len(names)), names)
        ax.set_title(styles[method].name, fontsize=9, color=styles[method].color)
        ax.tick_params(length=0)
        ax.spines[:].set_visible(False)
    figure.colorbar(image, ax=axes, label="correlation", shrink=0.8)
    return figure


def quantity(name: str) -> str:
    """A parameter or a derived quantity, without its unit."""
    known = PARAMETERS.get(name, ("s·d" if name == "damping_product" else name, 1.0))[0]
    return known.split(" [")[0].replace("_", " ")
