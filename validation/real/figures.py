"""Figures of docs/real.md."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from sling2sim2real.simulator.rubber import uniaxial
from validation.real import data

COLUMNS = 5


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
