"""Coordinates in which a rollout changes nearly evenly: log E, ν, log s d, 1/friction, s, others.

Damping acts through the product s d while the band is taut, and friction through the time that the
opening fingers need to let go, which goes with 1/friction. The prior stays that of the search's
box, uniform on its axes, times the method's own. What the law adds is linear, and so is the
air's drag, which is one of them where the method searches it, because launches feel it and a recoil
hardly tells it from damping.
"""

from __future__ import annotations

import numpy as np

from pipeline.objective.space import Space
from pipeline.sling.theta import point

YOUNG, POISSON, DAMPING, FRICTION, SCALE = range(5)
LEAST_SCALE = 1e-3  # of damping: below it nothing is damped, and the product has no logarithm
LEAST_FRICTION = 1e-3


class Axes:
    """The free parameters of a search in even coordinates, and the box they lie in."""

    def __init__(
        self,
        space: Space,
        theta: np.ndarray,
        fixed: set[str] = frozenset(),
        least_friction: float = 0.0,
    ) -> None:
        """Args:
        space: Box of θ, what its law adds, and air_drag where it is searched: P axes.
        theta: Values of the fixed ones are taken from here, shape (P,).
        least_friction: Below it the band slips out of the closed fingers.
        """
        self.space, self.theta = space, np.array(theta, float)
        self.free = np.array([i for i, name in enumerate(space.names) if name not in fixed])
        self.names = tuple(space.names[i] for i in self.free)
        self.low, self.high = space.low.copy(), space.high.copy()
        self.low[SCALE] = max(self.low[SCALE], min(LEAST_SCALE, self.high[SCALE]))
        room = self.high[FRICTION] - self.low[FRICTION]
        least = min(least_friction, self.high[FRICTION] - 0.02 * room)
        self.low[FRICTION] = max(self.low[FRICTION], least, LEAST_FRICTION)

    @classmethod
    def of_method(cls, params, method: str, content: dict, least_friction: float) -> Axes:
        """What a method of params.yaml searches and launches feel, at a θ file's content.

        Within the method's bounds; what instruments add besides is not among the axes.
        """
        about = params.methods[method]
        drag = {name: ends for name, ends in about.nuisances.items() if name == "air_drag"}
        space = Space.of(params.parameters, drag, about.bounds, about.priors, about.law)
        theta = [*point(content), *(content["nuisances"][name] for name in drag)]
        return cls(space, np.array(theta), set(about.fixed), least_friction)

    def even(self, theta: np.ndarray) -> np.ndarray:
        """Coordinates (N, D) of physical parameters (N, P)."""
        young, poisson, damping, friction, scale, *others = np.asarray(theta, float).T
        product = damping * np.maximum(scale, LEAST_SCALE)
        columns = [np.log(young), poisson, np.log(product), 1 / friction, scale, *others]
        return np.stack(columns, axis=1)[:, self.free]

    def physical(self, even: np.ndarray) -> np.ndarray:
        """Physical parameters (N, P) of coordinates (N, D)."""
        theta = np.tile(self.theta, (len(even), 1))
        columns = dict(zip(self.free.tolist(), np.asarray(even, float).T, strict=True))
        for i in (POISSON, *range(SCALE, len(self.theta))):
            if i in columns:
                theta[:, i] = columns[i]
        if YOUNG in columns:
            theta[:, YOUNG] = np.exp(columns[YOUNG])
        if DAMPING in columns:
            theta[:, DAMPING] = np.exp(columns[DAMPING]) / np.maximum(theta[:, SCALE], LEAST_SCALE)
        if FRICTION in columns:
            theta[:, FRICTION] = 1 / np.maximum(columns[FRICTION], 1e-6)
        return theta

    def clipped(self, even: np.ndarray) -> np.ndarray:
        """The nearest coordinates in the box."""
        theta = self.physical(even)
        theta[:, self.free] = np.clip(theta, self.low, self.high)[:, self.free]
        return self.even(theta)

    def inside(self, theta: np.ndarray) -> np.ndarray:
        """Which physical parameters (N, P) lie in the box on every free axis, (N,)."""
        good = (theta >= self.low * (1 - 1e-9)) & (theta <= self.high * (1 + 1e-9))
        return good[:, self.free].all(axis=1)

    def log_volume(self, theta: np.ndarray) -> np.ndarray:
        """Log of the box's volume (uniform prior) that a unit of coordinates takes, (N,)."""
        changes = np.zeros(len(theta))
        linear = ~self.space.log
        if FRICTION in self.free:  # d friction = friction² d(1/friction)
            power = 2 if linear[FRICTION] else 1
            changes += power * np.log(theta[:, FRICTION])
        if YOUNG in self.free and linear[YOUNG]:
            changes += np.log(theta[:, YOUNG])
        if DAMPING in self.free and linear[DAMPING]:
            changes += np.log(theta[:, DAMPING])
        if SCALE in self.free and not linear[SCALE]:
            changes -= np.log(theta[:, SCALE])
        if POISSON in self.free and not linear[POISSON]:
            changes -= np.log(theta[:, POISSON])
        return changes
