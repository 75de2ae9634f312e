"""The policies: how they were trained, and where each draw lands."""

from __future__ import annotations

from itertools import cycle

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from pipeline.report.figures.panels import explain, panels
from sling2sim2real.drawing.canvas import log_y, mark, picture
from sling2sim2real.drawing.styles import COLORS, INK, Styles
from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.launching.trials.stretch import stretch_of

AROUND = 0.03  # of the policies' draws, the part of the box that is shown [m]
DASHES = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (5, 1.5, 1, 1.5)))


@picture()
def training(curves: dict[str, dict[str, pd.DataFrame]], styles: Styles) -> Figure:
    """Error of the deterministic policy by iteration of PPO, in its own simulator.

    Args:
        curves: training.parquet of each band and method.
    """
    title = "A policy has converged where its curve stays below the line at 1 cm"
    figure, axes_of = panels(curves, title, 2.1, sharex=True, sharey=True)
    for band, ax in axes_of.items():
        for (method, curve), dash in zip(curves[band].items(), cycle(DASHES)):
            error = 100 * curve.mean_error
            ax.plot(curve.iteration, error, color=styles[method].color, lw=1.2, ls=dash)
        ax.axhline(1, color=INK, lw=0.8)
        ax.set_xlabel("PPO iteration (line: 1 cm)")
        log_y(ax)
    next(iter(axes_of.values())).set_ylabel("mean |landing − target| [cm]")
    methods = dict.fromkeys(method for of_band in curves.values() for method in of_band)
    dashes = dict(zip(methods, cycle(DASHES)))
    explain(figure, [(styles[m].name, mark(color=styles[m].color, ls=dashes[m])) for m in methods])
    return figure


@picture({"axes.grid": False})
def landing_maps(
    maps: dict[str, LandingMap],
    draws: dict[str, np.ndarray],
    targets: np.ndarray,
    recorded: dict[str, float],
    fork_width: float,
    rest_lengths: dict[str, float],
) -> Figure:
    """Where draws about its policy's path land by one method's simulator.

    Args:
        maps: By band.
        draws: By band, of the policy from the near to the far target [m], shape (N, 2).
        targets: Whose landings are drawn as lines [m].
        recorded: By band, the largest stretch of the recording; beyond, θ is extrapolated.
        rest_lengths: By band [m].
    """
    title = "Where each draw lands, and which draws the policy takes for near and far targets"
    figure, axes_of = panels(maps, title, 2.6, sharex=True, sharey=True)
    low = np.min([path.min(0) for path in draws.values()], axis=0) - AROUND
    high = np.max([path.max(0) for path in draws.values()], axis=0) + AROUND
    charts = {band: _fine(landing_map, low, high) for band, landing_map in maps.items()}
    landings = np.concatenate([landing[np.isfinite(landing)] for *_, landing in charts.values()])
    levels = (
        MaxNLocator(16).tick_values(landings.min(), landings.max()) if len(landings) else [0, 1]
    )
    shades = plt.cm.ScalarMappable(BoundaryNorm(levels, 256), "cividis")
    beyond = False
    for band, ax in axes_of.items():
        y, z, landing = charts[band]
        points = np.stack([0 * y.ravel(), y.ravel(), z.ravel()], 1)
        stretch = stretch_of(points, fork_width, rest_lengths[band]).reshape(y.shape)
        ax.set_facecolor("0.8")
        if np.isfinite(landing).any():
            ax.contourf(y, z, landing, levels=levels, cmap=shades.cmap, norm=shades.norm)
            line = {"levels": np.unique(targets), "colors": "w", "linewidths": 0.9}
            ax.clabel(ax.contour(y, z, landing, **line), fmt="%g m", fontsize=7)
        if stretch.min() < recorded[band] < stretch.max():
            beyond = True
            ax.contour(y, z, stretch, levels=[recorded[band]], colors="k", linestyles=":")
        ax.plot(*draws[band].T, color=COLORS[0], lw=2.5)
        ax.plot(*draws[band][0], "o", color=COLORS[0])
        ax.set(xlabel="draw y [m]", xlim=y[[0, -1], 0], ylim=z[0, [0, -1]])
    next(iter(axes_of.values())).set_ylabel("draw z [m]")
    figure.colorbar(shades, ax=list(axes_of.values()), label="simulated landing [m]")
    entries = [("policy's draws, from near (dot) to far", mark(color=COLORS[0], lw=2.5))]
    if beyond:
        entries.append(("recorded stretch; left: extrapolated", mark(color="k", ls=":")))
    if any(np.isnan(landing).any() for *_, landing in charts.values()):
        entries.append(("the launch fails", mark(ls="", marker="s", color="0.8")))
    explain(figure, entries)
    return figure


def _fine(
    chart: LandingMap, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draws y and z within limits and the map's box, and where they land, finely [m]."""
    sides = [
        np.linspace(max(side[0], least), min(side[-1], most), 121)
        for side, least, most in zip((chart.draw_y, chart.draw_z), low, high, strict=True)
    ]
    y, z = np.meshgrid(*sides, indexing="ij")
    return y, z, chart(np.stack([y.ravel(), z.ravel()], 1)).landing_y.reshape(y.shape)
