"""Pictures and figures of docs/rig.md: the law against Treloar's points, the recorded pulls.

    python tools/rig_pictures.py data/raw/band1/band1.mcap ...  # recordings of rig bands, by name

Writes docs/rig/treloar.png (where ../shared/data is there), docs/rig/pulls.png and
docs/rig/recoil.png. What is drawn is what the recordings hold, not the rig's truth.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pipeline.base.errors import run
from pipeline.params import load
from pipeline.recording.build import process
from pipeline.recording.input import images
from pipeline.report.drawing.styles import COLORS, INK, THEME
from rig.physics.elasticity import TRELOAR as LAW

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "rig"
TRELOAR = ROOT.parent / "shared/data/treloar_1944.csv"
SMOOTHED = 0.1  # s before the release, where the filtered force falls already


def main() -> None:
    plt.rcParams.update(THEME)
    FOLDER.mkdir(exist_ok=True)
    if TRELOAR.is_file():
        treloar()
    params = load(ROOT / "params.yaml")
    done = {Path(name).stem: None for name in sys.argv[1:]}
    for name in sys.argv[1:]:
        band = Path(name).stem
        done[band] = process(Path(name), params.bands[band], params)
    if done:
        pulls(done)
        recoil(next(iter(done.values())))


def treloar() -> None:
    with TRELOAR.open() as file:
        rows = [row for row in csv.DictReader(file) if row["test"] == "uniaxial"]
    stretch, stress = np.array(
        [(float(row["stretch"]), float(row["nominal_stress_MPa"])) for row in rows]
    ).T
    fine = np.linspace(1, stretch.max(), 300)
    neo = fine - fine**-2
    first = stretch < 1.6
    modulus = np.sum(stress[first] * (stretch - stretch**-2)[first])
    modulus /= np.sum((stretch - stretch**-2)[first] ** 2)
    error = LAW.stress(stretch)[0] / stress - 1
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2), width_ratios=(3, 2))
    left.plot(stretch, stress, "o", color=INK, ms=4, label="Treloar 1944, uniaxial")
    left.plot(fine, LAW.stress(fine)[0], color=COLORS[1], label="Ogden, three terms (the rig)")
    left.plot(fine, modulus * neo, "--", color=COLORS[0], label="neo-Hookean (the simulator's law)")
    left.set(xlabel="stretch", ylabel="nominal stress [MPa]", ylim=(0, 1.05 * stress.max()))
    left.legend()
    right.axhline(0, color=INK, lw=0.8)
    right.plot(stretch, 100 * error, "o-", color=COLORS[1], ms=4)
    right.set(xlabel="stretch", ylabel="error of the fit [%]", ylim=(-6, 6))
    figure.savefig(FOLDER / "treloar.png", dpi=130)


def pulls(done: dict) -> None:
    """Force against draw: up along the pull, down in the pause; then over time."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.2))
    for color, (band, pull) in zip(COLORS, done.items(), strict=False):
        signals = pull.signals
        end = signals.release_time - SMOOTHED
        held = (signals.time > signals.grasp_time) & (signals.time < end)
        force = np.linalg.norm(signals.force, axis=1)
        draw = -signals.position[:, 1]
        left.plot(100 * draw[held], force[held], color=color, label=band)
        peak = force[held].max()
        since = signals.time - signals.time[held][np.argmax(force[held])]
        pause = held & (since > -0.5)
        right.plot(since[pause], 100 * force[pause] / peak, color=color, label=band)
    left.set(xlabel="draw [cm]", ylabel="recorded force [N]")
    right.set(xlabel="since the peak [s]", ylabel="force [% of the peak]")
    left.legend()
    figure.savefig(FOLDER / "pulls.png", dpi=130)


def recoil(done) -> None:
    """The frames around the release, colour and depth."""
    recording, signals = done.pull.recording, done.signals
    times = recording.color.seconds(signals.origin)
    first = np.searchsorted(times, signals.release_time) - 1
    figure, axes = plt.subplots(2, 3, figsize=(8, 4.2))
    for column, k in enumerate(range(first, first + 3)):
        color = images.color(recording.color.values[k])[..., ::-1]
        depth = images.depth(recording.depth.values[k])
        axes[0, column].imshow(color)
        axes[0, column].set_title(f"{1e3 * (times[k] - signals.release_time):+.0f} ms")
        axes[1, column].imshow(np.where(depth > 0, depth, np.nan), cmap="viridis_r")
    for axis in axes.flat:
        axis.set_axis_off()
    figure.savefig(FOLDER / "recoil.png", dpi=130)


if __name__ == "__main__":
    run(main)
