"""The box of the search: physical parameters to the unit cube and back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.params import Params
from pipeline.params.identification import LAWS, Parameters
from pipeline.simulator.material import THETA
from pipeline.simulator.rubber import NEO_HOOKEAN


@dataclass(frozen=True)
class Space:
    """A box with axes on linear or logarithmic scales.

    Attributes:
        names: Of the axes, length D.
        low, high: Physical bounds, shape (D,).
        log: Which axes are logarithmic, shape (D,).
    """

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    log: np.ndarray

    @classmethod
    def of(
        cls,
        parameters: Parameters,
        bounds: dict[str, tuple[float, float]] | None = None,
        law: str = NEO_HOOKEAN,
    ) -> Space:
        """Make it from params.yaml's `parameters`, in the simulator's order: θ, then its law's.

        A method's `bounds` take the place of a parameter's own, and say those of what its law adds.
        """
        boxes = {name: getattr(parameters, name) for name in THETA}
        bounds = bounds or {}
        known = {name: bounds.get(name, (box.low, box.high)) for name, box in boxes.items()}
        known |= {name: bounds[name] for name in LAWS[law]}
        low, high = np.array([*known.values()], float).T
        log = [name in boxes and boxes[name].scale == "log" for name in known]
        return cls(tuple(known), low, high, np.array(log))

    @classmethod
    def of_method(cls, params: Params, method: str) -> Space:
        """The box that a method of params.yaml searches, within its bounds."""
        about = params.methods[method]
        return cls.of(params.parameters, about.bounds, about.law)

    @property
    def dimension(self) -> int:
        return len(self.names)

    def to_physical(self, unit: np.ndarray) -> np.ndarray:
        """Physical values, shape (..., D), of points in the unit cube, shape (..., D)."""
        unit = np.asarray(unit, float)
        low, high = self._scaled(self.low), self._scaled(self.high)
        value = low + unit * (high - low)
        value = np.where(self.log, np.exp(np.where(self.log, value, 0.0)), value)
        return np.clip(value, self.low, self.high)  # exp(log(high)) may round above high

    def to_unit(self, theta: np.ndarray) -> np.ndarray:
        """Points in the unit cube, shape (..., D), of physical values, shape (..., D)."""
        low, high = self._scaled(self.low), self._scaled(self.high)
        return (self._scaled(np.asarray(theta, float)) - low) / (high - low)

    def _scaled(self, value: np.ndarray) -> np.ndarray:
        return np.where(self.log, np.log(np.where(self.log, value, 1.0)), value)


def reflect(unit: np.ndarray) -> np.ndarray:
    """Fold points at the faces of the unit cube until they lie in it; those inside stay."""
    folded = np.mod(unit, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
