"""Coordinates of the density, in which a rollout changes nearly evenly.

A taut band feels the product s d alone. Over L/c, the time that a small wave takes along the band
(c^2 = E A L/m), it is what a recoil loses; rubbers differ in it less than in s d.

log E, log of the loss factor s d c/L, what the law adds, the linear rest of the air's drag, how far
damping brakes turns, and the log of the returned share: what a launch gets of the energy that the
law would give it, which launches alone can show. What no recording of a pull can tell is fixed by
the method: Poisson's ratio, friction and the damping's scale.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pipeline.params import Params
from pipeline.params.identification import LAWS, UNSEEN
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import EXTRA, THETA, Parameters

YOUNG, POISSON, DAMPING, FRICTION, SCALE = range(5)
LOGS = "log_youngs_modulus", "log_loss_factor"  # of Pa
STEPS = {  # of finite differences
    "log_youngs_modulus": 0.005,
    "log_loss_factor": 0.05,
    "mooney_share": 0.02,
    "upturn": 0.01,
    "softening": 0.02,
    "relaxation": 0.004,
    "air_drag": 0.25,
    "turn_damping": 0.1,
    "log_returned_share": 0.01,
}
MOST_DRAG, MOST_LOST = 8.0, 0.3  # 1/s, of a logarithm
PRIORS = {  # mean and standard deviation of Gaussians
    "log_loss_factor": (
        np.log(0.06),
        0.35,
    ),  # of the rubbers that validation/rubbers.py DEVELOPs on
    "air_drag": (0.0, 1.0),  # a half-normal: little beside the cylinder's drag
    "log_returned_share": (0.0, 0.015),  # the law's discrepancy, common to a band's launches
}


@dataclass(frozen=True)
class Coordinates:
    """Of D free parameters.

    Attributes:
        law: Whose parameters they stand for.
        names: Of the coordinates, length D.
        low, high: Their bounds, shape (D,).
        fixed: Values of UNSEEN by name.
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
    def of_method(cls, params: Params, method: str, sling: ClampedBand) -> Coordinates:
        """Of a method of params.yaml that searches by least squares, and its band's sling."""
        about = params.methods[method]
        box = {name: (one.low, one.high) for name, one in params.parameters} | dict(about.bounds)
        young, damping = (box[THETA[i]] for i in (YOUNG, DAMPING))
        product = np.array(damping) * about.fixed["damping_scale"]
        wave = np.sqrt(sling.rest_length * sling.mass / sling.area)
        loss = np.log(product / wave) + np.log(young) / 2
        ends = dict(zip(LOGS, (np.log(young), loss), strict=True))
        ends |= {name: box[name] for name in LAWS[about.law]} | {
            "air_drag": (0.0, MOST_DRAG),
            "turn_damping": (0.0, 1.0),
            "log_returned_share": (-MOST_LOST, MOST_LOST),
        }
        low, high = np.array(list(ends.values()), float).T
        expected, spread = np.array([PRIORS.get(name, (0.0, np.inf)) for name in ends]).T
        fixed = {name: about.fixed[name] for name in UNSEEN}
        return cls(about.law, tuple(ends), low, high, fixed, float(wave), expected, spread**-2)

    @property
    def steps(self) -> np.ndarray:
        """Of finite differences, shape (D,)."""
        return np.array([STEPS[name] for name in self.names])

    def parameters(self, phi: np.ndarray) -> Parameters:
        """N parameters of coordinates (N, D)."""
        theta = np.empty((len(phi), len(THETA)))
        theta[:, YOUNG] = np.exp(phi[:, 0])
        for name in UNSEEN:
            theta[:, THETA.index(name)] = self.fixed[name]
        product = np.exp(phi[:, 1] - phi[:, 0] / 2) * self.wave
        theta[:, DAMPING] = product / self.fixed["damping_scale"]
        values = np.concatenate([theta, phi[:, 2:-1], np.exp(phi[:, -1:])], axis=1)
        return Parameters(self.law, values)

    def of(self, parameters: Parameters) -> np.ndarray:
        """Coordinates (D,) of one sample of what is searched, within the bounds.

        What is beside that (EXTRA) is as expected.
        """
        phi, own = self.expected.copy(), len(self.names) - len(EXTRA)
        theta = parameters.values[0]
        loss = theta[DAMPING] * self.fixed["damping_scale"] * np.sqrt(theta[YOUNG]) / self.wave
        phi[:2] = np.log(theta[YOUNG]), np.log(loss)
        phi[2:own] = theta[len(THETA) : -len(EXTRA)]
        return np.clip(phi, self.low, self.high)
