"""A projectile in its pouch, beside a band in PhysX: from rest at the draw until they part."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.export.mesh import Tube
from pipeline.simulator.launch import Launches, outcomes
from pipeline.simulator.model import GRAVITY, ClampedBand, LaunchSetup
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.records import LANE, Outcome
from validation.engines.physx.law import energy, force_on
from validation.engines.physx.rollouts import BURST, SPACE
from validation.engines.physx.study import clamped


@dataclass(frozen=True)
class Pushed:
    """Launches in PhysX.

    Attributes:
        launches: As ours.
        gained: Energy of projectile and pouch where they part, of the drawn band's by PhysX's law,
            shape (N,): above 1, the steps have made some; NaN where there is none.
    """

    launches: Launches
    gained: np.ndarray


def led_to(tube: Tube, places: np.ndarray) -> np.ndarray:
    """Targets (N, D, 3) of clamps and pouch, with the pouches at places (N, 3)."""
    ends = np.tile(clamped(tube)[1], (len(places), 1, 1))
    pouch = places[:, None] + tube.rest[tube.middle] * [0.0, 1.0, 1.0]
    return np.concatenate([ends, pouch], axis=1)


class Flight:
    """Projectiles in their pouches, a step on at each call.

    Called with the nodes (N, sections, V, 3) at rest, and then after each step; returns the
    targets (N, D, 3) for the next, or None when none is in its pouch any more.
    """

    def __init__(
        self, sling: ClampedBand, setup: LaunchSetup, tube: Tube, thetas, draws, rate: int
    ) -> None:
        self.sling, self.setup, self.tube = sling, setup, tube
        self.draws, self.step = np.asarray(draws), 1 / rate
        self.parameters = Parameters.of(sling.law, thetas)
        self.young, self.poisson, damping = np.asarray(thetas, float).T[:3]
        self.delay, size = damping * rate, len(draws)
        section = tube.mass.reshape(tube.rest.shape[:2])[tube.middle].sum()
        self.mass = setup.projectile_mass + section
        self.place = np.column_stack([np.zeros(size), self.draws])
        self.direction = -self.place / np.linalg.norm(self.place, axis=1, keepdims=True)
        self.speed, self.time = np.zeros((size, 3)), 0.0  # half a step behind the place
        self.before, self.last, self.burst = None, None, np.zeros(size, bool)
        self.lanes = np.zeros(size, LANE)
        self.lanes["outcome"], self.lanes["lowest"] = Outcome.GOING_ON, self.place[:, 2]
        self.stored = self.gained = np.full(size, np.nan)

    @np.errstate(all="ignore")  # burst bands
    def __call__(self, nodes: np.ndarray) -> np.ndarray | None:
        """One step. Bands that burst, and those whose projectile has left, are led no further."""
        sound = (np.abs(nodes) < SPACE).all(axis=(1, 2, 3))  # not a number: neither
        self.burst |= ~sound & self._going
        self.lanes["outcome"][~sound & self._going] = Outcome.NOT_CONVERGED
        nodes = np.where(sound[:, None, None, None], nodes, self.tube.rest)
        band, first = (nodes, self.young, self.poisson), self.before is None
        step = None if first else (self.before, self.delay)
        force = force_on(self.tube, [self.tube.middle], *band, step=step)
        if first:
            self.lanes["hold_force"] = self.last = force
            self.stored = energy(self.tube, *band)
        going = self._going
        self._part(going & ((force * self.direction).sum(axis=1) <= 0), force)
        self.lanes["lowest"][going] = np.minimum(self.lanes["lowest"], self.place[:, 2])[going]
        if self.time >= self.setup.duration or not self._going.any():
            return None
        going = self._going[:, None]
        kick = self.step / 2 if first else self.step
        pushed = force / self.mass - [0.0, 0.0, GRAVITY]
        self.speed = self.speed + np.where(going, kick * pushed, 0)
        self.place = self.place + np.where(going, self.step * self.speed, 0)
        self.before, self.last, self.time = nodes, force, self.time + self.step
        return led_to(self.tube, self.place)

    def outcome(self) -> Pushed:
        """What became of them."""
        done = outcomes(self.sling, self.setup, self.parameters, self.lanes, self.draws)
        failure = np.where(self.burst, BURST, np.array(done.failure, object)).tolist()
        return Pushed(replace(done, failure=failure), self.gained)

    @property
    def _going(self) -> np.ndarray:
        return self.lanes["outcome"] == Outcome.GOING_ON

    def _part(self, parts: np.ndarray, force: np.ndarray) -> None:
        """Store where those that part (N,) left, in the last step, when nothing pushes any more."""
        pushes = [(vector * self.direction).sum(axis=1) for vector in (self.last, force)]
        w = (pushes[0] / np.maximum(pushes[0] - pushes[1], 1e-9)).clip(0, 1)[:, None]
        change = (w - 0.5) * self.last + (w**2 - 0.25) / 2 * (force - self.last)
        gravity = (w - 0.5) * np.array([0.0, 0.0, GRAVITY])
        moving = self.step * (self.time > 0)
        place = self.place - (1 - w) * moving * self.speed
        speed = self.speed + moving * (change / self.mass - gravity)
        time = self.time - (1 - w[:, 0]) * moving
        left = np.column_stack([time, place[:, 1:], speed[:, 1:]])
        self.lanes["separation"][parts] = left[parts]
        self.lanes["outcome"][parts] = Outcome.SEPARATED
        height = GRAVITY * (place[:, 2] - self.draws[:, 1])
        gained = self.mass * ((speed**2).sum(axis=1) / 2 + height) / self.stored
        self.gained = np.where(parts, gained, self.gained)
