"""Launches in PhysX: the band pushes a projectile that is simulated beside it.

PhysX cannot free what it leads, so the pouch stays led: where a projectile would go that feels the
band's force by PhysX's law (law.py) and gravity, with the mass of the held section. A step of the
projectile follows each step of PhysX (leapfrog), until the band no longer pushes along the launch;
the projectile then flies as ours does. The arm does not give way; PhysX's band has no damping here
and feels no air.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.engines.physx import scene
from sling2sim2real.engines.physx.bands import BURST, LARGEST_PLACE_M, Engine
from sling2sim2real.engines.physx.law import force_on
from sling2sim2real.engines.physx.scene import Drive
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import STEPS_PER_S
from sling2sim2real.simulator.launch import Launches, outcomes
from sling2sim2real.simulator.model import GRAVITY, ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import LANE, Outcome
from sling2sim2real.simulator.rubber import NEO_HOOKEAN

HANG_S, PULL_S, HOLD_S = 1.0, 2.0, 1.0  # s


class Flight:
    """Projectiles in their pouches, a step on at each call.

    Called with the nodes (N, sections, V, 3) at rest, and then after each step; returns the
    targets (N, D, 3) for the next, or None when none is in its pouch any more.

    Args:
        thetas: The five parameters of each band, shape (N, 5).
        places: Where the pouches rest (y, z) [m], shape (N, 2).
    """

    def __init__(
        self,
        sling: ClampedBand,
        setup: LaunchSetup,
        tube: Tube,
        thetas: np.ndarray,
        places: np.ndarray,
    ) -> None:
        self.sling, self.setup, self.tube = sling, setup, tube
        self.start, self.step = np.asarray(places), 1 / STEPS_PER_S
        self.parameters = Parameters.of(NEO_HOOKEAN, thetas)
        self.young, self.poisson = np.asarray(thetas, float).T[:2]
        size = len(places)
        self.mass = setup.projectile_mass + tube.mass[tube.hand].sum()
        self.place = np.column_stack([np.zeros(size), self.start])
        self.direction = -self.place / np.linalg.norm(self.place, axis=1, keepdims=True)
        self.speed, self.time = np.zeros((size, 3)), 0.0  # half a step behind the place
        self.last, self.burst = None, np.zeros(size, bool)
        self.lanes = np.zeros(size, LANE)
        self.lanes["outcome"], self.lanes["lowest"] = Outcome.GOING_ON, self.place[:, 2]

    @np.errstate(all="ignore")  # burst bands
    def __call__(self, nodes: np.ndarray) -> np.ndarray | None:
        """One step. Bands that burst, and those whose projectile has left, are led no further."""
        sound: Any = (np.abs(nodes) < LARGEST_PLACE_M).all(axis=(1, 2, 3))  # not a number: neither
        self.burst |= ~sound & self._going
        self.lanes["outcome"][~sound & self._going] = Outcome.NOT_CONVERGED
        nodes = np.where(sound[:, None, None, None], nodes, self.tube.rest)
        first = self.last is None
        force = force_on(self.tube, [self.tube.middle], nodes, self.young, self.poisson)
        if first:
            self.lanes["hold_force"] = self.last = force
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
        self.last, self.time = force, self.time + self.step
        return led_to(self.tube, self.place)

    def outcome(self) -> Launches:
        """What became of them."""
        done = outcomes(self.sling, self.setup, self.parameters, self.lanes, self.start)
        failure = np.where(self.burst, BURST, np.array(done.failure, object)).tolist()
        return replace(done, failure=failure)

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


def launched(
    engine: Engine,
    text: str,
    tube: Tube,
    thetas: np.ndarray,
    sling: ClampedBand,
    setup: LaunchSetup,
    places: np.ndarray,
) -> Launches:
    """Launches from where the hand rests, `places` (N, 2) [m], by a stage of N bands.

    Args:
        text: The stage: `scene.text`, or of one band an exported stage.
        thetas: Of its bands, shape (N, 5).

    Raises:
        UserError: As `Engine.run`.
    """
    rigid = replace(setup, arm_stiffness=None, history=None)
    flight = Flight(sling, rigid, tube, thetas, places)
    flat = tube.clamped.reshape(-1, 3)
    start, phases = np.tile(flat, (len(places), 1, 1)), drives(tube, places)
    shape = (len(places), *tube.rest.shape)

    def steer(nodes: np.ndarray) -> np.ndarray | None:
        return flight(nodes.reshape(shape).astype(float))

    engine.run(text, scene.job(tube, start, phases), steer)
    return flight.outcome()


def drives(tube: Tube, places: np.ndarray) -> list[Drive]:
    """Hang in the clamps; then the middles are led to `places` (N, 2) and held there."""
    flat = tube.clamped.reshape(-1, 3)
    hang, pull, hold = (round(time * STEPS_PER_S) for time in (HANG_S, PULL_S, HOLD_S))
    part = minimum_jerk(np.arange(1, pull + hold + 1) / pull)
    begin = flat[tube.hand].mean(axis=0)
    goals = np.column_stack([np.zeros(len(places)), places])
    path = begin + part[:, None, None] * (goals - begin)
    led = led_to(tube, path.reshape(-1, 3))
    return [
        Drive(tube.ends, flat[tube.ends][None], np.zeros(hang)),
        Drive(
            np.concatenate([tube.ends, tube.hand]),
            led.reshape(*path.shape[:2], -1, 3),
            1 - part,
        ),
    ]


def led_to(tube: Tube, places: np.ndarray) -> np.ndarray:
    """Targets (N, D, 3) of clamps and pouch, with the pouches at places (N, 3)."""
    ends = np.tile(tube.clamped.reshape(-1, 3)[tube.ends], (len(places), 1, 1))
    pouch = places[:, None] + tube.rest[tube.middle] * [0.0, 1.0, 1.0]
    return np.concatenate([ends, pouch], axis=1)
