"""A loss over the box of parameters, for an optimiser of your own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from sling2sim2real.api.model import Model, Theta
from sling2sim2real.api.simulation import Simulation, simulate_batch
from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator
from sling2sim2real.simulator.parameters import EXTRA


class Objective:
    """The loss of an episode at points of the unit cube, whose axes are a method's free parameters.

    A point that no simulation can follow has an infinite loss.

    >>> import numpy as np
    >>> from sling2sim2real import Band, Model, Objective, Settings, Theta
    >>> from sling2sim2real import episode_from_arrays, rehearse
    >>> band = Band(mass=0.023, diameter=0.010, rest_length=0.52)
    >>> model = Model(band, Theta(2.0e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
    >>> episode = episode_from_arrays(**rehearse(model))
    >>> objective = Objective(model, [episode])
    >>> objective.names  # doctest: +NORMALIZE_WHITESPACE
    ('youngs_modulus', 'poissons_ratio', 'elasticity_damping', 'dynamic_friction', 'damping_scale')
    >>> here, middle = objective(np.stack([objective.unit(model.theta), np.full(5, 0.5)]))
    >>> bool(here < middle)
    True

    Attributes:
        names: Of the axes, length D.
        low, high: Physical bounds, shape (D,).
    """

    def __init__(
        self,
        model: Model,
        episodes: Sequence[Episode],
        *,
        method: str = "paper",
        loss: Callable[[Simulation, Episode], float] | None = None,
    ) -> None:
        """Prepare the loss; several episodes count alike.

        Args:
            model: The band, its mounting and settings. Of its θ the paper's loss takes what has no
                axis (air drag, rotational damping share), your own nothing.
            episodes: At least one.
            method: Of `settings.methods`: its law, box, fixed parameters and weights.
            loss: Your own, of a simulation; None: the paper's, of geometry, force and work.

        Raises:
            UserError: No such method, or no episode.
        """
        methods = model.settings.methods
        if method not in methods:
            raise UserError(f"method {method}: settings.methods has {', '.join(methods)}")
        if not episodes:
            raise UserError("episodes: give at least one")
        box, theta = SearchBox.of_method(model.settings, method), model.theta.parameters.sample()
        box = replace(box, fixed={**box.fixed, **{name: theta[name] for name in EXTRA}})
        self._box, self.names = box, box.free
        self.low, self.high = (ends[box.axes] for ends in (box.low, box.high))
        self._model, self._own, self._episodes = model, loss, list(episodes)
        self._evaluators = (
            [] if loss else [self._evaluator(episode, method) for episode in episodes]
        )

    def _evaluator(self, episode: Episode, method: str) -> Evaluator:
        law = self._model.settings.methods[method].law
        sling = replace(self._model.sling, law=law)
        return Evaluator.of(self._model.settings, method, episode, sling, self._box)

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        """Losses (N,) of points of the unit cube (N, D); +inf where a simulation fails.

        Raises:
            UserError: They have another shape, or lie outside the cube.
        """
        unit = np.asarray(unit, float)
        if unit.ndim != 2 or unit.shape[1] != len(self.names) or not len(unit):
            raise UserError(f"points: must have shape (N, {len(self.names)}), got {unit.shape}")
        if not ((unit >= 0) & (unit <= 1)).all():
            raise UserError("points: must lie in the unit cube, 0 to 1")
        if self._own is None:
            whole = self._box.fill(unit)
            return np.sum([evaluate(whole).total for evaluate in self._evaluators], axis=0)
        thetas = [self.theta(point) for point in unit]
        model = replace(self._model, theta=thetas[0])
        total = np.zeros(len(unit))
        for episode in self._episodes:
            for i, simulation in enumerate(simulate_batch(model, episode, thetas)):
                total[i] += np.inf if simulation.failure else self._own(simulation, episode)
        return total

    def theta(self, unit: np.ndarray) -> Theta:
        """θ at a point of the unit cube (D,)."""
        whole = self._box.fill(np.asarray(unit, float)[None])[0]
        return Theta.of(self._box.names, self._box.to_physical(whole), self._box.law)

    def unit(self, theta: Theta) -> np.ndarray:
        """The point (D,) of θ; fixed parameters are left out."""
        return self._box.unit_of(theta.parameters)[0, self._box.axes]
