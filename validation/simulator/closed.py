"""Closed forms that the simulator is held against.

The law is the stable neo-Hookean one without its logarithm (Smith, de Goes and Kim 2018, eq. 14 and
its Lame parameters, section 3.4), with J = det F:

    W = mu/2 (|F|^2 - 3) - mu (J - 1) + lam/2 (J - 1)^2

Uniaxial stress, F = diag(l, q, q): no stress across, mu q + (lam (J - 1) - mu) l q = 0, gives
J = 1 + mu/lam (1 - 1/l), and along the band the nominal stress P = mu (l - J / l^2).

Of the law `rubber`, in units of the shear modulus and written a second time: what its string pulls
with.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad, solve_ivp

from sling2sim2real.simulator.material import material
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import BRANCH_TIMES_S


@dataclass(frozen=True)
class String:
    """A straight band that neither bends nor weighs: a theta in uniaxial stress.

    Attributes:
        mu, lam: As `model.material` gives them [Pa].
        damping, scale: d [s] and s.
        turn_damping: Share of the damping that brakes turns.
    """

    sling: ClampedBand
    mu: float
    lam: float
    damping: float
    scale: float
    turn_damping: float = 0.0

    @classmethod
    def of(cls, sling: ClampedBand, theta, turn_damping: float = 0.0) -> String:
        """Make the string of THETA's values (5,)."""
        coefficients = material(sling, Parameters.of(sling.law, theta))[0].tolist()
        return cls(sling, *list(coefficients)[:4], turn_damping)

    def volume(self, stretch):
        """J at a stretch."""
        return 1 + self.mu / self.lam * (1 - 1 / np.asarray(stretch))

    def force(self, stretch):
        """Pull [N] at a stretch."""
        stretch = np.asarray(stretch)
        return self.sling.area * self.mu * (stretch - self.volume(stretch) / stretch**2)

    def tangents(self, stretch: float) -> tuple[np.ndarray, np.ndarray]:
        """Second derivatives by (stretch, section ratio q) of W, and its shape part; (2, 2) [Pa].

        The shape part is what is left without the volume's (lam - mu/3) J'^2.
        """
        j = self.volume(stretch)
        q = np.sqrt(j / stretch)
        p = self.lam * (j - 1) - self.mu
        slope = np.array([q**2, 2 * stretch * q])  # of J
        turn = np.array([[0.0, 2 * q], [2 * q, 2 * stretch]])
        common = self.mu * np.diag([1.0, 2.0]) + p * turn
        volume = np.outer(slope, slope)
        return common + self.lam * volume, common + self.mu / 3 * volume

    def axial(self, stretch: float) -> tuple[float, float]:
        """Stiffness k [N/m] and damping c [N s/m] of the middle node along the stretched band.

        Both halves act, k = 4 A / L dP/dl. The section follows the stretch without stress across,
        dq/dl = -W_lq / W_qq, as long as d is short against the period; then, with w = (1, dq/dl),
        k is w.H w and c is w.V w, V = d ((lam - mu/3) (dJ)^2 + s H_shape).
        """
        whole, shape = self.tangents(stretch)
        w = np.array([1.0, -whole[0, 1] / whole[1, 1]])
        per_length = 4 * self.sling.area / self.sling.rest_length
        viscous = self.damping * (whole - shape + self.scale * shape)
        return per_length * w @ whole @ w, per_length * w @ viscous @ w

    def transverse(self, stretch: float) -> tuple[float, float]:
        """The same across the band, k = 4 T / (l L): c is what brakes a turn of s d k."""
        k = 4 * float(self.force(stretch)) / (stretch * self.sling.rest_length)
        return k, self.turn_damping * self.scale * self.damping * k


def cantilever(load: float, length: float, rigidity: float) -> float:
    """Tip of a cantilever under an even load [N/m]: q L^4 / (8 E I)."""
    return load * length**4 / (8 * rigidity)


def clamped_beam(load: float, length: float, rigidity: float) -> float:
    """Middle of a beam clamped at both ends under an even load [N/m]: q L^4 / (384 E I)."""
    return load * length**4 / (384 * rigidity)


def oscillation(time: np.ndarray, mass: float, k: float, c: float, start: float) -> np.ndarray:
    """m x'' + c x' + k x = 0 from rest at `start`, under-damped."""
    decay = c / (2 * mass)
    rate = np.sqrt(k / mass - decay**2)
    angle = rate * time
    return start * np.exp(-decay * time) * (np.cos(angle) + decay / rate * np.sin(angle))


def stress(stretch, shape: tuple[float, float]):
    """Biderman (1958), over the shear modulus, incompressible: C10, C01 and C20."""
    share, upturn = shape
    first = stretch**2 + 2 / stretch - 3
    c10, c01, c20 = (1 - share) / 2, share / 2, upturn / 4
    return 2 * (stretch - stretch**-2) * (c10 + 2 * c20 * first + c01 / stretch)


def left_of(stretch: float, most: float, shape: tuple[float, float], softening: float) -> float:
    """Share of `stress` that is left after a stretch of `most`, by works that are integrated."""
    done, worst = (quad(stress, 1, end, args=(shape,))[0] for end in (stretch, most))
    gap = 1 - done / worst
    return 1 - 2.05 * softening * gap**2 / (gap**2 + gap + 0.05)


def relaxed_share(relaxation: float) -> tuple[float, float]:
    """What never relaxes of Young's modulus, and a branch's share of that."""
    weight = relaxation * np.log10(1e4 / 3e-3) / 7
    left = 1 - weight * sum(np.exp(-10 / time) for time in BRANCH_TIMES_S)
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
        return rate(then) * np.exp((then - time) / BRANCH_TIMES_S).sum()

    corners = [corner for corner in (0.2, 0.5) if corner < time]
    added = quad(kernel, 0, time, points=corners, limit=400, epsabs=1e-7)[0]
    return left * (stress(history(time), shape) + weight * added)


def flow_integral(
    history: Callable, times: np.ndarray, shape: tuple[float, float], flow: float, rate: float
) -> np.ndarray:
    """Stress of a string that flows, at rising times (T,): o' = p' - r |o/E|^3 o, by LSODA."""
    step = 1e-6

    def change(then: float, o: np.ndarray) -> np.ndarray:
        rise = stress(history(then + step), shape) - stress(history(then - step), shape)
        return rise / (2 * step) - rate * np.abs(o / 3) ** 3 * o

    accurate = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-9, "max_step": 1e-3}  # at corners too
    done = solve_ivp(change, (0, times[-1]), [0.0], t_eval=times, **accurate)
    return stress(history(times), shape) + flow * done.y[0]
