"""Coordinates of the density, in which a rollout changes nearly evenly.

A taut band feels the product s d alone. Over L/c, the time that a small wave takes along the band
(c^2 = E A L/m), it is what a recoil loses; rubbers differ in it less than in s d.

log E, log of the loss factor s d c/L, what the law adds, the linear rest of the air's drag, how far
damping brakes turns, and the log of the returned share: what a launch gets of the energy that the
law would give it, which launches alone can show. What no recording of a pull can tell is fixed by
the method: Poisson's ratio, friction and the damping's scale; and what of the law it fixes besides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import truncnorm

from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import THETA, Parameters

YOUNG, POISSON, DAMPING, FRICTION, SCALE = range(5)
LOGS = "log_youngs_modulus", "log_loss_factor"  # of Pa
LOSS = 1  # place of the loss factor among the coordinates
RETURNED = "log_returned_share"
SHOWN_BY = {  # coordinates of parameters that have another name
    "youngs_modulus": LOGS[0],
    "elasticity_damping": LOGS[1],
    "damping_product": LOGS[1],
    "returned_share": RETURNED,
}
STEPS = {  # of finite differences
    "log_youngs_modulus": 0.005,
    "log_loss_factor": 0.05,
    "mooney_share": 0.02,
    "upturn": 0.01,
    "softening": 0.02,
    "relaxation": 0.004,
    "flow": 0.01,
    "log_flow_rate": 0.03,
    "air_drag": 0.25,
    "turn_damping": 0.1,
    "log_returned_share": 0.01,
}
# Of 9 in 10 rubbers at 10 to 100 Hz: the range from butadiene to butyl rubber, by
# https://materialmap.github.io/rubber_damping_reference.html.
# A band with both ends held swings at pi c/L, where its damping s d makes tan delta = pi s d c/L.
TAN_DELTA = 0.03, 0.50
MOST_DRAG, MOST_LOST = 8.0, 0.3  # 1/s, of a logarithm
PRIORS = {  # mean and standard deviation of Gaussians
    "log_loss_factor": (
        np.log(np.sqrt(np.prod(TAN_DELTA)) / np.pi),
        np.log(TAN_DELTA[1] / TAN_DELTA[0]) / 2 / 1.645,
    ),
    # half-normals: slow cycles of elastomers return 64 to 82 % (10.5281/zenodo.14717689), by
    # softening alone 1 - 0.59 s, and by flow alone 1 - 2 flow or more
    "softening": (0.0, 0.3),
    "flow": (0.0, 0.15),
    "log_flow_rate": (2.0, 1.0),  # a stress of E/5 flows in a second, within a decade
    "air_drag": (0.0, 1.0),  # a half-normal: little beside the cylinder's drag
    "log_returned_share": (0.0, 0.015),  # the law's discrepancy, common to a band's launches
}


@dataclass(frozen=True)
class Coordinates:
    """Coordinates of the density, of D free parameters.

    Attributes:
        law: Whose parameters they stand for.
        names: Of the coordinates, length D.
        low, high: Their bounds, shape (D,).
        fixed: Values by name: of UNSEEN, and of the law's parameters that are no coordinates.
        wave: L / (c sqrt(E)) of the band [s Pa^-1/2].
        expected, precision: Of Gaussian priors, shape (D,); precision 0 where there is none.
    """

    law: str
    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    fixed: Mapping[str, float]
    wave: float
    expected: np.ndarray
    precision: np.ndarray

    @classmethod
    def of_method(cls, params: Settings, method: str, sling: ClampedBand) -> Coordinates:
        """Make the coordinates of a method and its band's sling.

        The method is of params.yaml and searches by least squares.
        """
        method_params = params.methods[method]
        box = {name: (axis.low, axis.high) for name, axis in params.parameters} | dict(
            method_params.bounds
        )
        young, damping = (box[THETA[i]] for i in (YOUNG, DAMPING))
        product = np.array(damping) * method_params.fixed["damping_scale"]
        wave = np.sqrt(sling.rest_length * sling.mass / sling.area)
        loss = np.log(product / wave) + np.log(young) / 2
        ends = dict(zip(LOGS, (np.log(young), loss), strict=True))
        ends |= {
            name: box[name] for name in LAWS[method_params.law] if name not in method_params.fixed
        } | {
            "air_drag": (0.0, MOST_DRAG),
            "turn_damping": (0.0, 1.0),
            "log_returned_share": (-MOST_LOST, MOST_LOST),
        }
        low, high = np.array(list(ends.values()), float).T
        expected, spread = np.array([PRIORS.get(name, (0.0, np.inf)) for name in ends]).T
        names, fixed = tuple(ends), dict(method_params.fixed)
        return cls(method_params.law, names, low, high, fixed, float(wave), expected, spread**-2)

    @property
    def steps(self) -> np.ndarray:
        """Steps of finite differences, shape (D,)."""
        return np.array([STEPS[name] for name in self.names])

    def differences(self, phi: np.ndarray) -> np.ndarray:
        """Steps of finite differences from coordinates (D,), away from the upper bounds."""
        return np.where(phi + self.steps > self.high, -self.steps, self.steps)

    def prior(self, level: float) -> np.ndarray:
        """Ends of the central `level` of each coordinate's prior, shape (2, D)."""
        return self.quantiles(np.repeat([[1 - level], [1 + level]], len(self.names), axis=1) / 2)

    def quantiles(self, parts: np.ndarray) -> np.ndarray:
        """Quantiles of the priors, each even or a Gaussian within its bounds, at parts (N, D)."""
        values = self.low + parts * (self.high - self.low)
        gaussian = self.precision > 0
        mean, spread = self.expected[gaussian], self.precision[gaussian] ** -0.5
        low, high = ((end[gaussian] - mean) / spread for end in (self.low, self.high))
        values[:, gaussian] = truncnorm.ppf(parts[:, gaussian], low, high, mean, spread)
        return values

    def shows(self, name: str) -> int | None:
        """Number of the coordinate that a parameter shows; None: it is fixed."""
        coordinate = SHOWN_BY.get(name, name)
        return self.names.index(coordinate) if coordinate in self.names else None

    def parameters(self, phi: np.ndarray) -> Parameters:
        """N parameters of coordinates (N, D)."""
        columns = dict(zip(self.names, phi.T, strict=True))
        young, loss, returned = (columns.pop(name) for name in (*LOGS, RETURNED))
        product = np.exp(loss - young / 2) * self.wave
        return Parameters.named(
            self.law,
            {
                **columns,
                THETA[YOUNG]: np.exp(young),
                THETA[DAMPING]: product / self.fixed["damping_scale"],
                "returned_share": np.exp(returned),
            },
            self.fixed,
        )

    def of(self, parameters: Parameters) -> np.ndarray:
        """Coordinates (D,) of one sample of what is searched, within the bounds.

        What is beside that (EXTRA) is as expected.
        """
        phi, theta = self.expected.copy(), parameters.values[0]
        loss = theta[DAMPING] * self.fixed["damping_scale"] * np.sqrt(theta[YOUNG]) / self.wave
        phi[:2] = np.log(theta[YOUNG]), np.log(loss)
        for name in LAWS[self.law]:
            if name in self.names:
                phi[self.names.index(name)] = parameters.column(name)[0]
        return np.clip(phi, self.low, self.high)
