"""Figure 4 of the paper: flights of the methods' launches, as a camera beside the sling sees them.

The recording's camera looks at the band, so that no flight is in its pictures: this one is drawn.
"""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.report.figures.panels import entitle
from pipeline.report.tables.evaluation import BULLSEYE
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.drawing.canvas import key, mark, picture
from sling2sim2real.drawing.styles import INK, Styles
from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.model import GRAVITY

PLACE, AIM = np.array([3.0, -0.6, 0.75]), np.array([0.0, 1.0, -0.2])  # of the camera, frame O [m]
POINTS = 40  # of a simulated flight
FLOOR_Y = -0.5, 2.9  # of the floor that is shown [m]
FLOOR_X = 0.5


def seen(points: np.ndarray) -> np.ndarray:
    """Where a pinhole camera at PLACE that looks at AIM has points (N, 3), shape (N, 2)."""
    ahead = (AIM - PLACE) / np.linalg.norm(AIM - PLACE)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(right, ahead), ahead], axis=1)
    x, y, depth = ((np.atleast_2d(points) - PLACE) @ axes).T
    return np.stack([x / depth, y / depth], axis=1)


def simulated(trial: dict, floor: float) -> np.ndarray:
    """The flight (K, 3) [m] of a predicted launch, without air, from the pouch to the floor."""
    speed, angle = trial["predicted_speed"], trial["predicted_angle"]
    vy, vz = speed * np.cos(angle), speed * np.sin(angle)
    y, z = trial["predicted_leave_y"], trial["predicted_leave_z"]
    time = np.linspace(0, (vz + np.sqrt(vz**2 + 2 * GRAVITY * (z - floor))) / GRAVITY, POINTS)
    return np.stack([0 * time, y + vy * time, z + vz * time - GRAVITY * time**2 / 2], axis=1)


@picture({"axes.grid": False})
def flights(trials: pd.DataFrame, setup: SetupParams, styles: Styles) -> Figure:
    """A panel a method: every virtual launch of a band, and what its simulator expected.

    Args:
        trials: Of one band.
        styles: Of the methods that are shown.
    """
    rows = -(-len(styles) // 2)
    figure, axes = plt.subplots(rows, 2, figsize=(5.6, 1.6 * rows + 1.0), squeeze=False)
    entitle(figure, "Flights of the launches at three targets, and as expected")
    for ax in axes.flat[len(styles) :]:
        ax.remove()
    floor = -setup.fork_height
    for ax, (method, style) in zip(axes.flat, styles.items(), strict=False):
        _scene(ax, trials.target.dropna().unique(), setup)
        mine = trials.loc[trials.method == method]
        for trial in mine.to_dict("records"):
            if trial["flight_y"] is not None:
                way = np.stack([0 * trial["flight_y"], trial["flight_y"], trial["flight_z"]], 1)
                ax.plot(*seen(way).T, color=style.color, lw=0.9, alpha=0.8)
                ax.plot(*seen(way[-1])[0], ".", color=style.color, ms=4)
            if np.isfinite(trial["predicted_speed"]):
                ax.plot(*seen(simulated(trial, floor)).T, color=INK, lw=0.6, ls="--", zorder=1)
        flown = mine.flight_y.notna().sum()
        lost = "" if flown == len(mine) else f" ({flown} of {len(mine)} flew)"
        ax.set_title(style.name + lost, fontsize=9, color=style.color)
    entries = [
        ("launched on the rig", mark(color="0.4", lw=1.2)),
        ("by the method's simulator", mark(color=INK, lw=0.8, ls="--")),
        (f"within {100 * BULLSEYE:.0f} cm of a target", mark(color=INK, lw=0.6)),
        ("target area, 1 m long", mark(color="0.8", lw=5)),
    ]
    key(figure, entries, 2)
    return figure


def _scene(ax: Axes, targets, setup: SetupParams) -> None:
    """Floor, fork, target area and bullseyes."""
    floor, half = -setup.fork_height, setup.fork_width / 2

    def flat(corners) -> np.ndarray:
        return seen(np.array([[x, y, floor] for x, y in corners]))

    def rectangle(low: float, high: float) -> np.ndarray:
        return flat([(-FLOOR_X, low), (FLOOR_X, low), (FLOOR_X, high), (-FLOOR_X, high)])

    ax.fill(*rectangle(*FLOOR_Y).T, color="0.94", lw=0, zorder=0)
    ax.fill(*rectangle(*TARGET_AREA).T, color="0.84", lw=0, zorder=0)
    turn = np.linspace(0, 2 * np.pi, 61)
    for target in targets:
        ring = np.stack([BULLSEYE * np.cos(turn), target + BULLSEYE * np.sin(turn)], axis=1)
        ax.plot(*flat(ring).T, color=INK, lw=0.6, zorder=1)
    for x in (-half, half):
        ax.plot(*seen(np.array([[x, 0, floor], [x, 0, 0]])).T, color="0.35", lw=2)
    edges = np.concatenate([rectangle(*FLOOR_Y), seen(np.array([[0, 1.0, 0.55]]))])
    low, high = edges.min(axis=0), edges.max(axis=0)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.axis("off")
