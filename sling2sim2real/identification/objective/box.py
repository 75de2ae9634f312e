"""The box of a search: its axes, what of them is fixed, and the unit cube that optimisers see."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LAWS, ParameterBoxes, parameter_names
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN


@dataclass(frozen=True)
class SearchBox:
    """A box with D axes on linear or logarithmic scales, F of which are searched.

    Attributes:
        names: Of the axes, length D.
        low, high: Physical bounds, shape (D,).
        log: Which axes are logarithmic, shape (D,).
        law: Whose parameters the axes are.
        fixed: Physical values by name: of axes that are not searched, and of parameters that have
            no axis.
    """

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    log: np.ndarray
    law: str = NEO_HOOKEAN
    fixed: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        boxes: ParameterBoxes,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        law: str = NEO_HOOKEAN,
        fixed: Mapping[str, float] | None = None,
    ) -> SearchBox:
        """Make it from params.yaml's `parameters`, in the simulator's order: θ, then its law's.

        A method's `bounds` take the place of a parameter's own, and say those of what its law adds.
        """
        given, names = dict(boxes), parameter_names(law)
        ends = LAWS[law] | {n: (axis.low, axis.high) for n, axis in boxes} | dict(bounds or {})
        ends = [ends[name] for name in names]
        low, high = np.array(ends, float).T
        log = np.array([name in given and given[name].scale == "log" for name in names])
        return cls(names, low, high, log, law, dict(fixed or {}))

    @classmethod
    def of_method(cls, params: Settings, method: str) -> SearchBox:
        """The box that a method of params.yaml searches, within its bounds."""
        settings = params.methods[method]
        return cls.of(params.parameters, settings.bounds, settings.law, settings.fixed)

    @property
    def dimension(self) -> int:
        return len(self.names)

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the axes that are searched, length F."""
        return tuple(name for name in self.names if name not in self.fixed)

    @property
    def axes(self) -> np.ndarray:
        """Their numbers, shape (F,)."""
        return np.array([self.names.index(name) for name in self.free])

    @cached_property
    def _rest(self) -> np.ndarray:
        """A point of the whole unit cube that holds the fixed coordinates, shape (D,)."""
        middle = self.to_physical(np.full(self.dimension, 0.5))
        values = [
            self.fixed.get(name, middle_value)
            for name, middle_value in zip(self.names, middle, strict=True)
        ]
        return self.to_unit(np.array(values, float))

    def fill(self, unit: np.ndarray) -> np.ndarray:
        """Points of the whole cube, shape (N, D), for points of the free one, shape (N, F)."""
        whole = np.tile(self._rest, (len(unit), 1))
        whole[:, self.axes] = unit
        return whole

    def to_physical(self, unit: np.ndarray) -> np.ndarray:
        """Physical values, shape (..., D), of points in the unit cube, shape (..., D)."""
        unit = np.asarray(unit, float)
        low, high = self._scaled(self.low), self._scaled(self.high)
        value = low + unit * (high - low)
        value = np.where(self.log, np.exp(np.where(self.log, value, 0.0)), value)
        return np.clip(value, self.low, self.high)  # exp(log(high)) may round above high

    def to_unit(self, values: np.ndarray) -> np.ndarray:
        """Points in the unit cube, shape (..., D), of physical values, shape (..., D)."""
        low, high = self._scaled(self.low), self._scaled(self.high)
        return (self._scaled(np.asarray(values, float)) - low) / (high - low)

    def parameters(self, values: np.ndarray) -> Parameters:
        """All parameters of physical values of the axes, shape (N, D)."""
        return Parameters.named(self.law, dict(zip(self.names, values.T, strict=True)), self.fixed)

    def unit_of(self, parameters: Parameters) -> np.ndarray:
        """Points in the unit cube, shape (N, D); what has no axis is left out."""
        return self.to_unit(np.stack([parameters.column(name) for name in self.names], axis=1))

    def _scaled(self, value: np.ndarray) -> np.ndarray:
        return np.where(self.log, np.log(np.where(self.log, value, 1.0)), value)


def reflect(unit: np.ndarray) -> np.ndarray:
    """Fold points at the faces of the unit cube until they lie in it; those inside stay."""
    folded = np.mod(unit, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)


def latin_hypercube(dimension: int, count: int, seed: int) -> np.ndarray:
    """Points of the unit cube, one in each of `count` strata of each axis, (count, dimension).

    SciPy's differential evolution shifts what it is given by a half and back; these points stand
    that to the last bit, so that all searches start with the very same ones.
    """
    from scipy.stats import qmc  # which takes half a second

    points = qmc.LatinHypercube(dimension, rng=np.random.default_rng(seed)).random(count)
    return (points - 0.5) + 0.5
