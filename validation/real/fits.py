"""Fits of the law `rubber` to one specimen, and how far off it stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.rubber import (
    BRANCH_TIMES_S,
    RUBBER,
    relaxed,
    softened,
    uniaxial,
    update,
    work,
)
from validation.real.data import Curve

REACH = LAWS[RUBBER]
MOST_SLACK = 0.03  # of the crosshead's stretch
NAMES = "mooney_share", "upturn", "softening", "relaxation"
START = {"mooney_share": 0.2, "upturn": 0.05, "softening": 0.1, "relaxation": 0.03}


@dataclass(frozen=True)
class CurveFit:
    """Values by name; what is left of the stress over its peak, shape (n,)."""

    values: dict[str, float]
    left: np.ndarray

    @property
    def rms(self) -> float:
        """Root mean square of what is left, in percent of the peak."""
        return float(100 * np.sqrt(np.mean(self.left**2)))


def history(
    stretch: np.ndarray, time: np.ndarray, values: dict[str, float], worst: float = 1.0
) -> np.ndarray:
    """Nominal stress over the shear modulus along a history (n,) that starts relaxed.

    `worst` is the largest stretch before it.
    """
    shape = values["mooney_share"], values["upturn"]
    virgin, done = uniaxial(stretch, *shape), work(stretch, *shape)
    most = np.maximum(np.maximum.accumulate(done), work(np.array(worst), *shape))
    eta = softened(done, most, values["softening"])
    left, weight = relaxed(values["relaxation"])
    forget, follow = update(np.diff(time))
    over, total = np.zeros(len(BRANCH_TIMES_S)), np.empty(len(stretch))
    total[0] = left * virgin[0]
    for k, change in enumerate(np.diff(virgin)):
        over = forget[k] * over + follow[k] * change
        total[k + 1] = left * eta[k + 1] * virgin[k + 1] + weight * over.sum()
    return total


def shape_of(curve: Curve, slack: float = 0.0) -> CurveFit:
    """Modulus, share, upturn and up to `slack` of the stretch, of a pull without a history."""
    peak = curve.stress.max()
    low = [1e-6 * peak, REACH["mooney_share"][0], REACH["upturn"][0], 0.0]
    high = [1e3 * peak, REACH["mooney_share"][1], REACH["upturn"][1], slack + 1e-9]

    def left(x: np.ndarray) -> np.ndarray:
        stretch = np.maximum(curve.stretch - x[3], 1.0)
        return (x[0] * uniaxial(stretch, x[1], x[2]) - curve.stress) / peak

    begin = [peak / 2, START["mooney_share"], START["upturn"], slack / 2]
    solution = least_squares(left, begin, bounds=(low, high), x_scale=[peak, 0.1, 0.05, 0.01])
    names = "shear_modulus", "mooney_share", "upturn", "slack"
    return CurveFit(dict(zip(names, map(float, solution.x), strict=True)), solution.fun)


def noise_of(curve: Curve) -> float:
    """Scatter of a pull about a smooth curve, in percent of its peak: by second differences."""
    bent = np.diff(curve.stress, 2)  # white noise gives them the variance 6
    return float(100 * np.sqrt(np.mean(bent**2) / 6) / curve.stress.max())


def memory_of(curves: list[Curve], names: tuple[str, ...] = NAMES) -> list[CurveFit]:
    """One modulus and one value of each of `names` for histories of one material."""
    peak = max(curve.stress.max() for curve in curves)

    def values(x: np.ndarray) -> dict[str, float]:
        return dict.fromkeys(NAMES, 0.0) | dict(zip(names, x[1:], strict=True))

    def left(x: np.ndarray) -> list[np.ndarray]:
        return [
            (x[0] * history(curve.stretch, curve.time, values(x)) - curve.stress)
            / curve.stress.max()
            for curve in curves
        ]

    low, high = np.array([REACH[name] for name in names]).T
    begin = [peak / 2, *(START[name] for name in names)]
    solution = least_squares(
        lambda x: np.concatenate(left(x)),
        begin,
        bounds=([1e-6 * peak, *low], [1e3 * peak, *high]),
        x_scale=[peak, *(0.1 for _ in names)],
    )
    summary = {
        "shear_modulus": float(solution.x[0]),
        **{k: float(v) for k, v in values(solution.x).items()},
    }
    return [CurveFit(summary, residuals) for residuals in left(solution.x)]


def biaxial(rows: np.ndarray, shape: tuple[float, float]) -> np.ndarray:
    """Nominal stresses (n, 2) over the shear modulus at stretches (n, 3) of a thin sheet."""
    share, upturn = shape
    squares = rows[:, :3] ** 2
    first = squares.sum(1) - 3
    c1, c2 = (1 - share + upturn * first) / 2, share / 2
    cauchy = 2 * (c1[:, None] * squares - c2 / squares)
    return (cauchy[:, :2] - cauchy[:, 2:]) / rows[:, :2]
