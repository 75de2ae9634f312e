"""The box of the search: physical parameters, and nuisances, to the unit cube and back."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.objective.nuisance import NUISANCES
from pipeline.params.identification import LAWS, Prior
from pipeline.sling.material import THETA
from pipeline.sling.rubber import NEO_HOOKEAN


@dataclass(frozen=True)
class Space:
    """A box with axes on linear or logarithmic scales.

    Attributes:
        names: Of the axes, length D.
        low, high: Physical bounds, shape (D,).
        log: Which axes are logarithmic, shape (D,).
        priors: What is known of axes besides their bounds, by name.
    """

    names: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    log: np.ndarray
    priors: dict[str, Prior] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        parameters,
        nuisances: dict[str, tuple[float, float]] | None = None,
        bounds: dict[str, tuple[float, float]] | None = None,
        priors: dict[str, Prior] | None = None,
        law: str = NEO_HOOKEAN,
    ) -> Space:
        """Make it from params.yaml's `parameters`, in the simulator's order: θ, then its law's.

        Of a method's `nuisances`, bounds by name, each adds a linear axis, in NUISANCES' order. Its
        `bounds` take the place of a parameter's own, and say those of what its law adds. `priors`
        of other nuisances are left out.
        """
        boxes = {name: getattr(parameters, name) for name in THETA}
        bounds, nuisances = bounds or {}, nuisances or {}
        known = {name: bounds.get(name, (box.low, box.high)) for name, box in boxes.items()}
        known |= {name: bounds[name] for name in LAWS[law]}
        others = {name: nuisances[name] for name in NUISANCES if name in nuisances}
        low, high = np.array([*known.values(), *others.values()], float).T
        log = [name in boxes and boxes[name].scale == "log" for name in (*known, *others)]
        return cls(
            names=(*known, *others),
            low=low,
            high=high,
            log=np.array(log),
            priors={name: known for name, known in (priors or {}).items() if name in others},
        )

    @classmethod
    def of_method(cls, params, method: str) -> Space:
        """The box that a method of params.yaml searches: within its bounds, with its nuisances."""
        about = params.methods[method]
        return cls.of(params.parameters, about.nuisances, about.bounds, about.priors, about.law)

    @property
    def dimension(self) -> int:
        return len(self.names)

    @property
    def nuisances(self) -> tuple[str, ...]:
        """The last axes: those that are no parameters of the simulator."""
        return tuple(name for name in self.names if name in NUISANCES)

    def cost(self, theta: np.ndarray) -> np.ndarray:
        """What the priors add to the loss of physical values, shape (N, D), shape (N,)."""
        sizes = self._sizes(theta).items()
        return sum((self.priors[name].weight * size for name, size in sizes), np.zeros(len(theta)))

    def log_prior(self, theta: np.ndarray) -> np.ndarray:
        """Log density of the priors at physical values, shape (N, D), up to a constant, (N,)."""
        return -sum(self._sizes(theta).values(), np.zeros(len(theta)))

    def _sizes(self, theta: np.ndarray) -> dict[str, np.ndarray]:
        """Sizes of the axes that have a prior, in units of its mean, by name, (N,) each."""
        columns = {name: np.abs(theta[:, self.names.index(name)]) for name in self.priors}
        return {name: column / self.priors[name].mean for name, column in columns.items()}

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
