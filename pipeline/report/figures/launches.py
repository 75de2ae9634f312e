"""Launches of every band and method side by side: flights, and landings on the target."""

from __future__ import annotations

from itertools import cycle

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.colors import to_rgb
from matplotlib.patches import Circle, Rectangle

from pipeline.base.target import TARGET_AREA
from pipeline.drawing.canvas import key, mark, patch, picture
from pipeline.drawing.styles import INK, SIDE_BY_SIDE, Styles
from pipeline.report.noise import landed
from pipeline.report.results import Results
from pipeline.sling.model import GRAVITY

BEHIND, BEYOND = -0.45, 0.35  # how far a picture reaches behind the fork, and past the target [m]
RINGS = (0.05, 0.10)  # around a target [m]
MARKS = ("v", "o", "^", "s", "D", "P")  # of targets, near to far
FLOOR, AREA = "0.55", "#dccaa6"


def flight(y: float, z: float, speed: float, angle: float, floor: float) -> np.ndarray:
    """Points (40, 2) of a flight without drag from (y, z) down to z = `floor` [m]."""
    up = speed * np.sin(angle)
    duration = (up + np.sqrt(up**2 + 2 * GRAVITY * max(z - floor, 0.0))) / GRAVITY
    time = np.linspace(0, duration, 40)
    return np.stack(
        [y + speed * np.cos(angle) * time, z + up * time - GRAVITY * time**2 / 2], axis=1
    )


@picture({"axes.grid": False, "axes.spines.bottom": False})
def trajectories(
    results: Results, methods: list[str], styles: Styles, fork_height: float
) -> plt.Figure:
    """Flights from the pouch to the floor, a panel a band and method, to scale.

    Args:
        methods: Those that ran on every band and are drawn.
    """
    panels = [(band, method) for band in results.methods for method in methods]
    columns = len(methods) if len(results.methods) > 1 else min(2, len(methods))
    rows = -(-len(panels) // columns)
    view = (BEHIND, TARGET_AREA[1] + BEYOND)
    trials = {pair: _with_target(results.methods[pair[0]][pair[1]].trials) for pair in panels}
    predicted = {pair: _predicted(one, -fork_height) for pair, one in trials.items()}
    flown = [z for one in trials.values() for z in one.flight_z.dropna()]
    flown += [points[:, 1] for flights in predicted.values() for points in flights]
    highest = max((max(z) for z in flown), default=0.0)
    low, high = -fork_height - 0.13, max(0.1, float(highest) + 0.05)
    wide = min(14.0 / columns, 5.6)
    tall = wide * (high - low) / (view[1] - view[0])
    figure, axes = plt.subplots(
        rows, columns, figsize=(columns * wide, rows * (tall + 0.35) + 0.9),
        sharex=True, sharey=True, squeeze=False,
    )  # fmt: skip
    for ax in axes.flat[len(panels) :]:
        ax.remove()
    for number, (ax, (band, method)) in enumerate(zip(axes.flat, panels, strict=False)):
        rows_of, style = trials[band, method], styles[method]
        _scenery(ax, fork_height, sorted(set(rows_of.target)), style.color)
        _flights(ax, rows_of, predicted[band, method], style.color, fork_height)
        ax.set_title(f"{band}, {style.name}", fontsize=9, color=style.color)
        ax.set(xlim=view, ylim=(low, high), aspect="equal")
        if number % columns == 0:
            ax.set_ylabel("z [m]")
        if number >= len(panels) - columns:
            ax.set_xlabel("y [m]")
    known = {
        "virtual": ("virtual flight, with drag (paler: nearer target)", mark(color="0.3")),
        "measured": ("measured landing", mark(color="0.3", ls="", marker="x")),
    }
    kinds = {kind for one in trials.values() for kind in one.kind}
    entries = [
        *(entry for kind, entry in known.items() if kind in kinds),
        ("predicted by the calibrated simulator", mark(color=INK, lw=0.6, ls=(0, (5, 3)))),
        ("fork", mark(color=INK, lw=2)),
        ("target on the floor, 1 m", patch(AREA)),
        ("aimed at", mark(ls="", marker="^", color="0.7", mec=INK, mew=0.5)),
    ]
    key(figure, entries, len(entries) if len(entries) < 4 else 3)
    return figure


def _with_target(trials: pd.DataFrame) -> pd.DataFrame:
    return trials[trials.target.notna()]


def _shades(targets: list[float], color: str) -> dict[float, np.ndarray]:
    """Of a method's colour, by target: the near one palest."""
    pale = 0.5 * (1 - np.arange(len(targets)) / max(len(targets) - 1, 1))
    shades = np.array(to_rgb(color)) * (1 - pale[:, None]) + pale[:, None]
    return dict(zip(targets, shades, strict=True))


def _scenery(ax: plt.Axes, fork_height: float, targets: list[float], color: str) -> None:
    """Fork, floor, the target on it, and the places on it that are aimed at."""
    floor, (near, far) = -fork_height, TARGET_AREA
    ax.axhline(floor, color=FLOOR, lw=1, zorder=1)
    ax.add_patch(Rectangle((near, floor - 0.04), far - near, 0.04, color=AREA, zorder=1, lw=0))
    ax.plot([0, 0], [floor, 0], color=INK, lw=2, solid_capstyle="butt", zorder=2)
    for target, shade in _shades(targets, color).items():
        ax.plot(target, floor - 0.08, "^", ms=5, color=shade, mec=INK, mew=0.5, zorder=4)


def _predicted(trials: pd.DataFrame, floor: float) -> list[np.ndarray]:
    """Flights of the calibrated simulator, one for equal draws."""
    leaves = ["predicted_leave_y", "predicted_leave_z", "predicted_speed", "predicted_angle"]
    rows = trials[leaves].dropna().drop_duplicates()
    return [flight(*leave, floor) for leave in rows.itertuples(index=False)]


def _flights(
    ax: plt.Axes, trials: pd.DataFrame, predicted: list[np.ndarray], color: str, fork_height: float
) -> None:
    shades = _shades(sorted(set(trials.target)), color)
    for one in trials.itertuples():
        if one.flight_y is not None:
            ax.plot(one.flight_y, one.flight_z, color=shades[one.target], lw=1, alpha=0.8, zorder=3)
        elif one.landing_y is not None and np.isfinite(one.landing_y):
            ax.plot(one.landing_y, -fork_height, "x", color=shades[one.target], ms=5, zorder=3)
    for points in predicted:
        ax.plot(*points.T, color=INK, lw=0.6, ls=(0, (5, 3)), zorder=5)
    if failed := _failed(trials):
        behind = {"facecolor": "w", "edgecolor": "none", "alpha": 0.8, "pad": 1}
        style = {"ha": "right", "va": "top", "fontsize": 8, "zorder": 6, "bbox": behind}
        ax.text(0.99, 0.97, ",\n".join(failed) + " failed", transform=ax.transAxes, **style)


def _failed(trials: pd.DataFrame) -> list[str]:
    """As in "3 of 15", of each kind some of which failed; the kind is named where there are two."""
    launched = trials[trials.kind != "predicted"]
    several = launched.kind.nunique() > 1
    return [
        f"{int(failed.sum())} of {len(failed)}" + f" {kind}" * several
        for kind, failed in (~landed(launched)).groupby(launched.kind)
        if failed.any()
    ]


@picture({"axes.grid": False})
def scatter(results: Results, methods: list[str], styles: Styles) -> plt.Figure:
    """Landings on the target, seen from above, a panel a band and a strip a method.

    Launches go in the plane of the band: nothing is known across it, and nothing is shown.

    Args:
        methods: Those that ran on every band and are drawn.
    """
    near, far = TARGET_AREA
    strips_of = {band: _strips(results, band, methods, styles) for band in results.methods}
    launched = [trials for strips in strips_of.values() for *_, trials in strips]
    kinds = sorted({kind for trials in launched for kind in trials.kind[landed(trials)]})
    more = 0.04 * max([0, *(len(_failed(trials)) - 1 for trials in launched)])  # for words [m]
    inches = min(4.5 * len(strips_of) + 0.6, 13.5), 5.6 + 6 * more
    figure, axes = plt.subplots(1, len(strips_of), figsize=inches, sharey=True, squeeze=False)
    for ax, (band, strips) in zip(axes.flat, strips_of.items(), strict=True):
        width = (far - near) / max(len(strips), 1)
        ax.add_patch(Rectangle((0, near), far - near, far - near, color=AREA, lw=0, alpha=0.6))
        for number, (_, color, trials) in enumerate(strips):
            middle = (number + 0.5) * width
            if number:
                ax.plot([number * width] * 2, TARGET_AREA, color="w", lw=2)
            _landings(ax, trials, middle, width, color)
        places = (np.arange(len(strips)) + 0.5) * width
        names = [name.replace(", ", ",\n") for name, _, _ in strips]
        ax.set_xticks(places, names, fontsize=8 if len(strips) <= SIDE_BY_SIDE else 6.8)
        ax.tick_params(axis="x", length=0)
        ax.set(xlim=(-0.03, 1.03), ylim=(near - 0.02, far + 0.08 + more), aspect="equal")
        ax.set_title(band, fontsize=10)
        for label, (_, color, _) in zip(ax.get_xticklabels(), strips, strict=True):
            label.set_color(color)
    axes[0, 0].set_ylabel(f"{' and '.join(kinds) or 'no'} landing, y [m]")
    _key_of_targets(figure, results, kinds)
    return figure


def _strips(results: Results, band: str, methods: list[str], styles: Styles) -> list:
    """Name, colour and launches of each strip."""
    return [
        (
            styles[method].name,
            styles[method].color,
            _with_target(results.methods[band][method].trials),
        )
        for method in methods
    ]


def _landings(ax: plt.Axes, trials: pd.DataFrame, middle: float, width: float, color: str) -> None:
    """Rings around the targets and a mark a landing, in the strip about x = `middle`."""
    for target, sign in _marks(trials).items():
        for radius in RINGS:
            if radius <= 0.501 * width:
                ax.add_patch(Circle((middle, target), radius, fill=False, color="w", lw=1.2))
        ax.plot([middle - 0.015, middle + 0.015], [target] * 2, color=INK, lw=0.8)
        for kind, some in trials[(trials.target == target) & landed(trials)].groupby("kind"):
            style = {"facecolors": color, "edgecolors": "w", "linewidths": 0.4}
            if kind == "measured":  # hollow
                style = {"facecolors": "none", "edgecolors": color, "linewidths": 1.0}
            style |= {"s": 20, "marker": sign, "alpha": 0.85, "zorder": 3}
            ax.scatter([middle] * len(some), some.landing_y, **style)
    if failed := _failed(trials):
        text = "\n".join([*failed, "failed"])
        ax.text(middle, TARGET_AREA[1] + 0.01, text, ha="center", va="bottom", fontsize=6)


def _marks(trials: pd.DataFrame) -> dict[float, str]:
    """A mark a target, near to far."""
    return dict(zip(sorted(set(trials.target.dropna())), cycle(MARKS)))


def _key_of_targets(figure: plt.Figure, results: Results, kinds: list[str]) -> None:
    entries = [
        (f"aimed at {target:g} m", mark(ls="", marker=sign, color="0.4", mec="w"))
        for target, sign in _marks(results.trials).items()
    ]
    if "measured" in kinds:
        hollow = mark(ls="", marker="o", mfc="none", color="0.4")
        entries.append(("measured (filled: virtual)", hollow))
    words = " and ".join(f"{100 * radius:g}" for radius in RINGS)
    ring = mark(ls="", marker="o", ms=11, mfc=AREA, mec="w", mew=1.2)
    entries.append((f"rings of {words} cm around the targets", ring))
    entries.append(("target of 1 m × 1 m, a strip a method", patch(AREA, alpha=0.6)))
    key(figure, entries, 3)
