"""The policies: training, where each draw lands, and landings beside their predictions."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from pipeline.drawing.canvas import key, log_y, mark, patch, picture
from pipeline.drawing.styles import COLORS, SIDE_BY_SIDE, Styles, drawn
from pipeline.landing.landing_map import LandingMap
from pipeline.launches.stretch import stretch_of
from pipeline.report.results import Result

FAIR = 0.05  # of the distance, shaded
ERRORS = (-80, -50, -20, -10, -5, 0, 5, 10, 20, 50, 100, 200)  # % at the axis
REACH = 2.0  # of the farthest target, up to which a landing map tells landings apart
LEVEL = 90  # % that the predicted intervals are of


@picture()
def landings(trials: pd.DataFrame, styles: Styles, near: list[str]) -> plt.Figure:
    """Landings against predictions of two methods, and the error of every method.

    Args:
        styles: Of every method, in the order of the rows.
        near: Methods of the left panel.
    """
    trials = trials[trials.landing_y.notna() & trials.predicted_y.notna()]
    inside = trials.stretch <= trials.recorded_stretch
    tall = max(4.0, 1.6 + 0.3 * len(styles))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, tall), width_ratios=(1, 1.15))
    shown = trials[trials.method.isin(near)]
    both = shown[["landing_y", "predicted_y"]].to_numpy()
    low, high = (0, 1) if both.size == 0 else (0.95 * both.min(), 1.05 * both.max())
    line = np.array([low, high])
    left.fill_between(line, (1 - FAIR) * line, (1 + FAIR) * line, color="0.9", lw=0)
    left.plot(line, line, color="0.6", lw=1)
    kinds = " and ".join(sorted(set(trials.kind))) or "no"
    left.set(xlabel=f"{kinds} landing [m]", ylabel="predicted landing [m]")
    left.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    right.axvspan(-100 * FAIR, 100 * FAIR, color="0.9", lw=0)
    right.axvline(0, color="0.6", lw=1)
    for row, (method, style) in enumerate(styles.items()):
        for chosen, face in ((inside, style.color), (~inside, "none")):
            mine = trials[(trials.method == method) & chosen]
            if method in near:
                _with_intervals(left, mine, style.color, face)
            error = 100 * (mine.predicted_y / mine.landing_y - 1)
            right.scatter(
                error, [row] * len(mine), s=20, facecolors=face, edgecolors=style.color, alpha=0.7
            )
    right.set_yticks(range(len(styles)), [style.name for style in styles.values()])
    right.set_ylim(len(styles) - 0.5, -0.5)
    right.set_xscale("symlog", linthresh=10)
    right.xaxis.set_major_locator(plt.FixedLocator(ERRORS))
    right.xaxis.set_major_formatter("{x:g}")
    right.set_xlabel("predicted / landed − 1 [%], logarithmic beyond ± 10")
    dot = {"ls": "", "marker": "o"}
    entries = [(styles[m].name, mark(**dot, color=styles[m].color)) for m in near]
    entries += [
        ("inside the recorded stretch", mark(**dot, ms=5, color="0.4")),
        ("beyond it", mark(**dot, ms=5, color="0.4", mfc="none")),
        (f"± {100 * FAIR:g} %", patch("0.9")),
    ]
    if trials.predicted_low.notna().any():
        entries.append((f"{LEVEL} % interval", mark(color="0.4", lw=1)))
    key(figure, entries, 4)
    return figure


def _with_intervals(ax: plt.Axes, trials: pd.DataFrame, color: str, face: str) -> None:
    for one in trials[trials.predicted_low.notna()].itertuples():
        ends = [one.predicted_low, one.predicted_high]
        ax.plot([one.landing_y] * 2, ends, color=color, lw=1, alpha=0.5)
    ax.scatter(
        trials.landing_y, trials.predicted_y, s=20, facecolors=face, edgecolors=color, alpha=0.8
    )


@picture()
def training(results: dict[str, Result], styles: Styles) -> plt.Figure:
    """Landing error of the deterministic policy by iteration of PPO, in its own simulator."""
    first = drawn(results, SIDE_BY_SIDE)  # on top where curves lie on each other
    figure, ax = plt.subplots(figsize=(7.2, 3.4))
    for method, result in results.items():
        curve, own = result.training, styles[method]
        style = {"lw": 1.6, "zorder": 3} if method in first else {"lw": 0.9, "zorder": 2}
        error = 100 * curve.mean_error
        ax.plot(curve.iteration, error, color=own.color, label=own.name, **style)
    ax.axhline(1, color="0.6", lw=1)
    ax.set(xlabel="PPO iteration (line: the aim of 1 cm)", ylabel="mean |landing − target| [cm]")
    log_y(ax)
    figure.legend(loc="outside right upper")
    return figure


@picture()
def landing_map(
    result: Result,
    draws: np.ndarray,
    targets: np.ndarray,
    recorded: float,
    fork_width: float,
    rest_length: float,
) -> plt.Figure:
    """Landing against draw, with the policy's path over its targets.

    Args:
        draws: The policy's [m] from the near to the far target, shape (N, 2).
        targets: Whose landings are drawn as lines [m].
        recorded: Largest stretch of the recording; what lies beyond is extrapolated.
    """
    chart: LandingMap = result.landing_map
    fine_y, fine_z = (np.linspace(a[0], a[-1], 161) for a in (chart.draw_y, chart.draw_z))
    y, z = np.meshgrid(fine_y, fine_z, indexing="ij")
    points = np.stack([y.ravel(), z.ravel()], 1)
    landing = chart(points).landing_y.reshape(y.shape)
    stretch = stretch_of(np.insert(points, 0, 0, axis=1), fork_width, rest_length).reshape(y.shape)
    figure, ax = plt.subplots(figsize=(6, 4.6))
    ax.set_facecolor("0.8")
    ax.grid(False)
    if np.isfinite(landing).any():
        levels = _round(landing, REACH * targets.max())
        filled = ax.contourf(y, z, landing, levels=levels, cmap="viridis", extend="max")
        figure.colorbar(filled, label="simulated landing [m] (grey: the launch fails)")
        lines = ax.contour(y, z, landing, levels=np.unique(targets), colors="w", linewidths=0.8)
        ax.clabel(lines, fmt="%g m", fontsize=7)
    if stretch.min() < recorded < stretch.max():
        ax.contour(y, z, stretch, levels=[recorded], colors="k", linestyles=":")
        ax.plot([], [], "k:", label=f"recorded stretch {recorded:.2f}: beyond is extrapolated")
    ax.plot(*draws.T, color=COLORS[0], lw=2.5, label="the policy's draws, near (dot) to far target")
    ax.plot(*draws[0], "o", color=COLORS[0])
    ax.set(xlabel="draw y [m]", ylabel="draw z [m]")
    ax.set(xlim=(fine_y[0], fine_y[-1]), ylim=(fine_z[0], fine_z[-1]))
    figure.legend(loc="outside lower center", ncols=2, fontsize=8)
    return figure


def _round(values: np.ndarray, most: float) -> np.ndarray:
    """Some twenty round levels over finite values, but for those beyond `most`."""
    low, high = np.nanmin(values), np.nanmax(values)
    return plt.MaxNLocator(20).tick_values(low, min(high, most) if low < most else high)
