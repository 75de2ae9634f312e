"""Pictures of reports/simulator.md, one function a file. Equal data give equal bytes."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from pipeline.report.drawing.styles import COLORS, INK, THEME


def _save(figure, path: Path) -> None:
    figure.savefig(path, dpi=120, metadata={"Software": None})
    plt.close(figure)


def pull(path: Path, stretch: np.ndarray, curves: dict[str, tuple[np.ndarray, np.ndarray]]) -> None:
    """Pull over E A against stretch, and what is missing to the closed form.

    Args:
        curves: Measured and closed-form pull over E A, shape (S,) each, by name.
    """
    with plt.rc_context(THEME):
        figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2))
        for number, (name, (measured, closed)) in enumerate(curves.items()):
            left.plot(stretch, closed, color=INK, lw=1, zorder=1)
            left.plot(stretch, measured, "o", ms=4, color=COLORS[number], label=name)
            right.plot(
                stretch, 100 * (measured / closed - 1), "o-", ms=3, lw=1, color=COLORS[number]
            )
        left.plot([], [], color=INK, lw=1, label="closed form")
        left.set(xlabel="stretch", ylabel="pull / (E A)")
        left.legend()
        right.axhspan(-0.5, 0.5, color="0.92", zorder=0)
        right.set(
            xlabel="stretch (grey: 0.5 %)", ylabel="simulator − closed form [%]", ylim=(-0.6, 0.6)
        )
        _save(figure, path)


def oscillation(path: Path, cases: dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]) -> None:
    """Displacement of the heavy middle over time, simulated and in closed form.

    Args:
        cases: Time [s], simulated and closed-form displacement [m], shape (S,) each, by name.
    """
    with plt.rc_context(THEME):
        figure, axes = plt.subplots(1, len(cases), figsize=(9, 2.8), sharey=True)
        for number, (ax, (name, (time, place, closed))) in enumerate(
            zip(np.atleast_1d(axes), cases.items(), strict=True)
        ):
            shown = slice(None, None, max(len(time) // 60, 1))
            ax.plot(time, 1e3 * closed, color=INK, lw=1, label="oscillator, closed form")
            ax.plot(
                time[shown],
                1e3 * place[shown],
                "o",
                ms=2.5,
                color=COLORS[number],
                label="simulator",
            )
            ax.set(title=name, xlabel="time [s]")
        np.atleast_1d(axes)[0].set_ylabel("displacement [mm]")
        np.atleast_1d(axes)[-1].legend(loc="upper right")
        _save(figure, path)


def balance(path: Path, done) -> None:
    """The energies of energy.Balance over time, and around the release."""
    entries = ("elastic", "kinetic", "gravity", "viscous", "pads", "integrator")
    names = {"viscous": "damping", "integrator": "steps"}
    with plt.rc_context(THEME):
        figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), sharey=True, width_ratios=(1, 1.4))
        work = done.hand + done.turning
        lost = 1e3 * (done.time - done.release)
        for ax, time in ((axes[0], done.time), (axes[1], lost)):
            parts = np.array([getattr(done, name) for name in entries])
            for number, name in enumerate(entries):
                ax.plot(
                    time, parts[number], color=COLORS[number], lw=1.2, label=names.get(name, name)
                )
            ax.plot(time, work, color=INK, lw=2, alpha=0.5, label="work of the hand")
            ax.plot(time, parts.sum(0), color="k", ls=":", lw=1, label="sum of the others")
        axes[0].set(xlabel="time [s]", ylabel="energy since the band hung [J]")
        axes[1].set(xlabel="time after the release [ms]", xlim=(-10, 100))
        axes[1].legend(ncols=2, loc="center right")
        _save(figure, path)
