"""Figures of docs/real.md."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pipeline.simulator.rubber import uniaxial
from validation.real import data

COLUMNS = 5
APART = 0.55  # m, from one time to the next


def draw(folder: Path, source: Path, content: dict) -> None:
    """silicones.png: each specimen's pull up to 1.85, and the law's."""
    folder.mkdir(parents=True, exist_ok=True)
    curves = data.silicones(source)
    rows = -(-len(curves) // COLUMNS)
    figure, axes = plt.subplots(rows, COLUMNS, figsize=(11, 2.1 * rows), sharex=True)
    for axis in axes.flat[len(curves) :]:
        axis.set_visible(False)
    for axis, whole in zip(axes.flat, curves, strict=False):
        curve = whole.up_to(1.85)
        fit = content["silicones"]["specimens"][whole.name]["1.85"]
        stretch = np.linspace(1, 1.85, 100)
        pulled = np.maximum(stretch - fit["slack"], 1.0)
        law = fit["shear_modulus"] * uniaxial(pulled, fit["mooney_share"], fit["upturn"])
        axis.plot(curve.stretch, curve.stress, ".", color="0.55", markersize=3)
        axis.plot(stretch, law, color="tab:blue", linewidth=1)
        axis.set_title(f"{whole.name.replace('_', ' ')}: {fit['rms_percent']:.2g} %", fontsize=7)
        axis.tick_params(labelsize=6)
    figure.supxlabel("stretch", fontsize=8)
    figure.supylabel("nominal stress [MPa]", fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "silicones.png", dpi=110, metadata={"Software": None})
    plt.close(figure)


def draw_ropes(
    folder: Path, runs: dict[str, np.ndarray], summary: dict[str, np.ndarray], content: dict
) -> None:
    """ropes.png: predicted runs (T, M, 3) at four times, seen from the side, and their error."""
    folder.mkdir(parents=True, exist_ok=True)
    figure, rows = plt.subplots(2, len(runs), figsize=(11, 5), height_ratios=(2, 1), sharey="row")
    for name, shape, error in zip(runs, *rows, strict=True):
        run, other = runs[name], summary[name]
        for k, frame in enumerate(np.linspace(0, len(run) - 1, 5).astype(int)[1:]):
            side, top = _side(run[frame]), run[frame, [0, -1], 2].max() + APART * k
            for markers, style in ((run, "o-"), (other, "-")):
                place = (markers[frame] - run[frame, 0]) @ side
                look = {"color": "0.6" if markers is run else "tab:blue", "lw": 1, "ms": 2}
                shape.plot(place, markers[frame, :, 2] - top, style, **look)
        prediction = content["ropes"][name]["predicted_run"]
        shape.set_title(f"{name}: {prediction['rms_mm']:.0f} mm", fontsize=8)
        shape.set_aspect("equal")
        gaps = np.linalg.norm(other - run, axis=2)[:, 2:-2]
        error.plot(np.arange(len(run)) / 100, 1e3 * np.sqrt((gaps**2).mean(1)), linewidth=1)
        for axis in (shape, error):
            axis.tick_params(labelsize=6)
        error.set_xlabel("time [s]", fontsize=7)
    rows[0, 0].set_ylabel(f"height, each time {APART} m lower [m]", fontsize=7)
    rows[1, 0].set_ylabel("rms [mm]", fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "ropes.png", dpi=110, metadata={"Software": None})
    plt.close(figure)


def _side(markers: np.ndarray) -> np.ndarray:
    """Level unit vector from one end to the other, of markers (M, 3)."""
    way = (markers[-1] - markers[0]) * [1, 1, 0]
    return way / np.linalg.norm(way)
