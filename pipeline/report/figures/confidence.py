"""How far θ* is to be trusted: marginals of the density, and correlations."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np

from pipeline.drawing.canvas import PARAMETERS, few_ticks, key, mark, patch, picture
from pipeline.drawing.styles import INK, Styles
from pipeline.report.results import Result

BINS = 14
SHOWN = {  # label, and factor from SI
    "youngs_modulus": ("E [kPa]", 1e-3),
    "mooney_share": ("Mooney's share", 1.0),
    "relaxation": ("relaxation [%]", 1e2),
    "damping_product": ("s·d [ms]", 1e3),
    "turn_damping": ("turn damping", 1.0),
    "air_drag": ("drag beside the air's [1/s]", 1.0),
    "returned_share": ("returned share [%]", 1e2),
}


@picture()
def marginals(results: dict[str, Result], styles: Styles) -> plt.Figure:
    """Marginals of the density's samples, with 90 % intervals and θ*.

    Args:
        results: Methods whose θ has a confidence.
    """
    figure, axes = plt.subplots(2, 4, figsize=(10.8, 4.6))
    for ax, (name, (label, factor)) in zip(axes.flat, SHOWN.items(), strict=False):
        for number, (method, result) in enumerate(results.items()):
            if name not in known(result):
                continue
            samples, best = factor * _column(result, name), factor * _best(result, name)
            color = styles[method].color
            edges = np.histogram_bin_edges(samples, BINS)
            counts, edges = np.histogram(samples, edges)
            ax.stairs(counts / counts.max(), edges, fill=True, color=color, alpha=0.25)
            about = known(result)[name]
            height = 1.12 + 0.12 * number
            ends = factor * about["low"], factor * about["high"]
            ax.plot(ends, [height, height], color=color, lw=3, solid_capstyle="butt")
            ax.plot(best, height, "o", ms=6, color=color, mec="w", mew=1)
        ax.set(xlabel=label, yticks=[], ylim=(0, 1.3 + 0.12 * len(results)))
        few_ticks(ax.xaxis)
    axes.flat[-1].axis("off")
    entries = [(styles[method].name, mark(color=styles[method].color)) for method in results]
    level = next(iter(results.values())).confidence["level"]
    entries += [
        (f"{100 * level:g} % interval and θ*", mark(color="0.4", lw=3)),
        ("samples", patch("0.8")),
    ]
    key(figure, entries)
    return figure


def known(result: Result) -> dict:
    """Intervals by name."""
    return result.confidence["parameters"] | result.confidence["derived"]


def _column(result: Result, name: str) -> np.ndarray:
    """Samples of a parameter, SI units, shape (S,)."""
    samples, names = np.array(result.posterior["samples"], float), result.posterior["names"]
    if name == "damping_product":
        return _column(result, "damping_scale") * _column(result, "elasticity_damping")
    if name not in names:
        return np.full(len(samples), known(result)[name]["value"])
    return samples[:, names.index(name)]


def _best(result: Result, name: str) -> float:
    theta = result.theta["theta"]
    return theta[name] if name in theta else result.confidence["derived"][name]["value"]


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
