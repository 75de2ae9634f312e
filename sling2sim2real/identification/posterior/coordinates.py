"""Coordinates of the density, in which a rollout changes nearly evenly.

A taut band feels the product s d alone. Over L/c, the time that a small wave takes along the band
(c^2 = E A L/m), it is what a recoil loses; rubbers differ in it less than in s d.

log E, log of the loss factor s d c/L, what the law adds, the linear rest of the air's drag, how far
damping brakes turns, and the log of the returned share: what a launch gets of the energy that the
law would give it, which launches alone can show. What no recording of a pull can tell is fixed by
the method: Poisson's ratio, friction and the damping's scale; and what of the law it fixes besides.

Many rubbers have nothing of an effect that others have, such as softening. Its coordinate is that
of a rectified Gaussian: below 0 the parameter is 0, which so has half of the prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import truncnorm

from sling2sim2real.base.parameters import Coordinate, Parameter, parameters
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

LOSS = 1  # place of the loss factor among the coordinates
DAMPING, PRODUCT = "elasticity_damping", "damping_product"


def shown(law: str) -> dict[str, tuple[Parameter, Coordinate]]:
    """What coordinates show of a law's parameters, by the coordinates' names, in their order."""
    return {row.shown_by: (row, row.coordinate) for row in parameters(law) if row.coordinate}


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
        lowest: `low`, but -inf of a rectified one; samples lie between it and `high`, shape (D,).
    """

    law: str
    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    fixed: Mapping[str, float]
    wave: float
    expected: np.ndarray
    precision: np.ndarray
    lowest: np.ndarray

    @classmethod
    def of_method(cls, params: Settings, method: str, sling: ClampedBand) -> Coordinates:
        """Make the coordinates of a method and its band's sling.

        The method is of params.yaml and searches by least squares.
        """
        method_params = params.methods[method]
        box = {name: (axis.low, axis.high) for name, axis in params.parameters}
        box |= dict(method_params.bounds)
        wave = np.sqrt(sling.rest_length * sling.mass / sling.area)
        young, fixed = box["youngs_modulus"], dict(method_params.fixed)
        rows = {
            name: both
            for name, both in shown(method_params.law).items()
            if both[0].name not in fixed
        }
        ends = []
        for row, coordinate in rows.values():
            bounds = coordinate.bounds or box[row.name]
            if row.name == DAMPING:
                product = np.array(bounds) * fixed["damping_scale"]
                bounds = np.log(product / wave) + np.log(young) / 2
            elif coordinate.log and coordinate.bounds is None:
                bounds = np.log(bounds)
            ends.append(bounds)
        priors = [coordinate.prior or (0.0, np.inf) for _, coordinate in rows.values()]
        (low, high), (expected, spread) = np.array(ends, float).T, np.array(priors).T
        rectified = [coordinate.rectified for _, coordinate in rows.values()]
        lowest, law = np.where(rectified, -np.inf, low), method_params.law
        return cls(law, tuple(rows), low, high, fixed, float(wave), expected, spread**-2, lowest)

    @property
    def steps(self) -> np.ndarray:
        """Steps of finite differences, shape (D,)."""
        return np.array([shown(self.law)[name][1].step for name in self.names])

    def differences(self, phi: np.ndarray) -> np.ndarray:
        """Steps of finite differences from coordinates (D,), away from the upper bounds."""
        return np.where(phi + self.steps > self.high, -self.steps, self.steps)

    def prior(self, level: float) -> np.ndarray:
        """Ends of the central `level` of each coordinate's prior, shape (2, D)."""
        return self.quantiles(np.repeat([[1 - level], [1 + level]], len(self.names), axis=1) / 2)

    def quantiles(self, parts: np.ndarray) -> np.ndarray:
        """Quantiles of the priors at parts (N, D): even, or a Gaussian within bounds, rectified."""
        values = self.low + parts * (self.high - self.low)
        gaussian = self.precision > 0
        mean, spread = self.expected[gaussian], self.precision[gaussian] ** -0.5
        low, high = ((end[gaussian] - mean) / spread for end in (self.lowest, self.high))
        values[:, gaussian] = truncnorm.ppf(parts[:, gaussian], low, high, mean, spread)
        return self.rectified(values)

    @property
    def spikes(self) -> np.ndarray:
        """What a rectified prior has at its end, over its density there, shape (D,); else 0."""
        spikes, rectified = np.zeros(len(self.names)), self.lowest < self.low
        spikes[rectified] = np.sqrt(np.pi / 2 / self.precision[rectified])
        return spikes

    def rectified(self, phi: np.ndarray) -> np.ndarray:
        """Coordinates (N, D) of which none is below its parameter's end."""
        return np.maximum(phi, self.low)

    def shows(self, name: str) -> int | None:
        """Number of the coordinate that a parameter shows; None: it is fixed."""
        name = DAMPING if name == PRODUCT else name
        names = [row.name for row, _ in shown(self.law).values() if row.shown_by in self.names]
        return names.index(name) if name in names else None

    def parameters(self, phi: np.ndarray) -> Parameters:
        """N parameters of coordinates (N, D)."""
        coordinates, columns = dict(zip(self.names, phi.T, strict=True)), {}
        for name, values in coordinates.items():
            row, coordinate = shown(self.law)[name]
            columns[row.name] = np.exp(values) if coordinate.log else values
        # of the loss factor s d c/L, the damping time d
        columns[DAMPING] = columns[DAMPING] * self.wave / self.fixed["damping_scale"]
        columns[DAMPING] /= np.sqrt(columns["youngs_modulus"])
        return Parameters.named(self.law, columns, self.fixed)

    def of(self, parameters: Parameters) -> np.ndarray:
        """Coordinates (D,) of one sample of what is searched, within the bounds.

        What is beside that (EXTRA) is as expected.
        """
        phi = self.expected.copy()
        for place, name in enumerate(self.names):
            row, coordinate = shown(self.law)[name]
            if coordinate.bounds is None:
                value = parameters.column(row.name)[0]
                if row.name == DAMPING:
                    young = parameters.column("youngs_modulus")[0]
                    value *= self.fixed["damping_scale"] * np.sqrt(young) / self.wave
                phi[place] = np.log(value) if coordinate.log else value
        return np.clip(phi, self.low, self.high)
