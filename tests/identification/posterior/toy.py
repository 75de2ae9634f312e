"""Recordings without a simulator: curves of known least squares, for the fit."""

from types import SimpleNamespace

import numpy as np
from scipy.optimize import least_squares

from sling2sim2real.identification.posterior.coordinates import Coordinates, shown
from sling2sim2real.identification.posterior.expansion import Expansion
from sling2sim2real.identification.posterior.likelihood import Failed

NAMES = "mooney_share", "relaxation", "air_drag"
SIZE = np.array([shown("rubber")[name][1].step for name in NAMES])
TIME = np.linspace(0, 3, 40)


def space(low=(0.0, 0.0, 0.0), high=(50.0, 50.0, 50.0), expected=0.0, spread=np.inf) -> Coordinates:
    """Three coordinates, bounds and priors in steps of their finite differences."""
    low, high = (SIZE * ends for ends in (low, high))
    precision = np.broadcast_to((spread * SIZE) ** -2.0, 3)
    return Coordinates("rubber", NAMES, low, high, {}, 1.0, expected * SIZE, precision, low)


def curve(phi: np.ndarray) -> np.ndarray:
    """x0 exp(-0.1 x1 t) + x2 of x in steps, shape (40,)."""
    first, rate, rest = phi / SIZE
    return first * np.exp(-0.1 * rate * TIME) + rest


def slopes(phi: np.ndarray) -> np.ndarray:
    first, rate, _ = phi / SIZE
    fall = np.exp(-0.1 * rate * TIME)
    return np.stack([fall, -0.1 * TIME * first * fall, np.ones_like(TIME)]) / SIZE[:, None]


class Curve:
    """A recording of `curve`; it fails where `fails` says so and keeps what it was asked."""

    def __init__(self, seen: np.ndarray, sigma: float = 0.1, fails=lambda phi: False) -> None:
        self.seen, self.sigma, self.fails = seen, sigma, fails
        self.episode, self.retained, self.requested = SimpleNamespace(band="toy"), [], []

    def expand(self, points, phi, steps, nuisances, pool, form=None) -> Expansion:
        self.retained.append(form)
        self.requested.append(phi)
        if self.fails(phi):
            raise Failed("it broke")
        left, design = (curve(phi) - self.seen) / self.sigma, slopes(phi) / self.sigma
        form = form or SimpleNamespace(number=len(self.retained), whitened=lambda x: x)
        parts = left, design, np.zeros((3, len(left))), np.zeros(len(left))
        return Expansion.of(form, *parts, np.zeros(3), np.ones(3), origin=0.0)


def least(recordings, coordinates: Coordinates, start: np.ndarray) -> np.ndarray:
    """SciPy's bounded minimum of the same density."""
    root = np.sqrt(coordinates.precision)

    def gaps(x: np.ndarray) -> np.ndarray:
        phi = x * SIZE
        data = [(recording.seen - curve(phi)) / recording.sigma for recording in recordings]
        return np.concatenate([*data, root * (phi - coordinates.expected)])

    ends = coordinates.low / SIZE, coordinates.high / SIZE
    exact = {"xtol": 1e-14, "ftol": 1e-14, "gtol": 1e-14}
    return least_squares(gaps, start / SIZE, bounds=ends, **exact).x * SIZE
