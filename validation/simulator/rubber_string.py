"""The law `rubber` in closed form, written a second time: what its string pulls with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import quad

from pipeline.simulator.rubber import TIMES


def stress(stretch, shape: tuple[float, float]):
    """Biderman (1958), over the shear modulus, incompressible: C10, C01 and C20."""
    share, upturn = shape
    first = stretch**2 + 2 / stretch - 3
    c10, c01, c20 = (1 - share) / 2, share / 2, upturn / 4
    return 2 * (stretch - stretch**-2) * (c10 + 2 * c20 * first + c01 / stretch)


def slope(stretch: float, shape: tuple[float, float]) -> float:
    step = 1e-5
    return float(stress(stretch + step, shape) - stress(stretch - step, shape)) / (2 * step)


def left_of(stretch: float, most: float, shape: tuple[float, float], softening: float) -> float:
    """Share of `stress` that is left after a stretch of `most`, by works that are integrated."""
    done, worst = (quad(stress, 1, end, args=(shape,))[0] for end in (stretch, most))
    gap = 1 - done / worst
    return 1 - 2.05 * softening * gap**2 / (gap**2 + gap + 0.05)


def relaxed_share(relaxation: float) -> tuple[float, float]:
    """What never relaxes of Young's modulus, and a branch's share of that."""
    weight = relaxation * np.log10(1e4 / 3e-3) / 7
    left = 1 - weight * sum(np.exp(-10 / time) for time in TIMES)
    return left, weight / left


def integral(
    history: Callable, time: float, shape: tuple[float, float], relaxation: float
) -> float:
    """Relaxed stress and what eight branches add of its rates: the hereditary integral."""
    left, weight = relaxed_share(relaxation)

    def rate(then: float) -> float:
        step = 1e-6
        return (stress(history(then + step), shape) - stress(history(then - step), shape)) / (
            2 * step
        )

    def kernel(then: float) -> float:
        return rate(then) * np.exp((then - time) / TIMES).sum()

    corners = [corner for corner in (0.2, 0.5) if corner < time]
    added = quad(kernel, 0, time, points=corners, limit=400, epsabs=1e-7)[0]
    return left * (stress(history(time), shape) + weight * added)
