"""The band as a string in 3-D: distributed mass, finite strain, relaxation, drag, a little bending.

    m x_tt = d/ds [T t - EI (1 + eta d/dt) P t_ss / |x_s|] + m g + drag,   T = A sigma(|x_s|, ...)

with s the reference length, t = x_s / |x_s| the tangent, P what lies across it, m the mass per s
and sigma from rubber.py. Bending acts on tangents, so that it does not feel how stretch changes.
Lumped masses on edges that are short near the clamps and the middle, where the band turns: second
order in space. Time is left to SciPy's LSODA (adaptive step and order).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp

from rig.physics.rubber import Rubber
from rig.physics.statics import balanced

GRAVITY = np.array([0.0, 0.0, -9.81])
AIR_DENSITY = 1.2  # kg/m3
CYLINDER_DRAG = 1.1  # coefficient of a cylinder across the wind
NUDGE = 1e-7  # of the difference quotients, in m, m/s, and MPa of the law
SETTLING_TIME = 4.0

Hand = Callable[[float, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Acceleration (3, ...) of the hand by time, and its place, velocity and the band's force on it."""


def still(time: float, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> np.ndarray:
    """A hand that does not move, whatever pulls."""
    return np.zeros_like(x)


class Falling:
    """Ends SciPy's integration where a value by time and state falls through zero."""

    terminal, direction = True, -1

    def __init__(self, value: Callable[[float, np.ndarray], float]) -> None:
        self.value = value

    def __call__(self, time: float, state: np.ndarray) -> float:
        return self.value(time, state)


TURN = 1.0  # diameters, in which clamps and hand turn the band
GRADING = 0.75  # edges are 1 - GRADING to 1 + GRADING of their mean


@dataclass(frozen=True)
class ElasticString:
    """A band between two clamps.

    A state Y has a row a node: x (3), v (3) and the rubber's memories (M) of the edge that follows
    it (those of the last row mean nothing). Arrays of states have trailing axes "...".

    Attributes:
        edges: Even, so that the middle is a node.
        length, diameter, mass: Of the free band at rest [m, m, kg].
        clamps: Both ends, shape (2, 3).
        clamp_direction: Unit vector along which the band leaves both clamps.
        rubber: The material.
        payload: Extra mass that the middle node carries [kg].
        damping: Of the motion, by mass [1/s]; 0 but for coming to rest.
    """

    edges: int
    length: float
    diameter: float
    mass: float
    clamps: np.ndarray
    clamp_direction: np.ndarray
    rubber: Rubber
    payload: float = 0.0
    damping: float = 0.0

    @property
    def nodes(self) -> int:
        return self.edges + 1

    @property
    def middle(self) -> int:
        return self.edges // 2

    @cached_property
    def sizes(self) -> np.ndarray:
        """Reference lengths of the edges [m], shape (edges,)."""
        part = np.linspace(0, 1, self.middle + 1)
        half = np.diff(part - GRADING * np.sin(2 * np.pi * part) / (2 * np.pi))
        return self.length / 2 * np.concatenate([half, half])

    @cached_property
    def shares(self) -> np.ndarray:
        """Reference length of each node's share of the band [m], shape (nodes,)."""
        return (np.append(self.sizes, 0) + np.append(0, self.sizes)) / 2

    @cached_property
    def turns(self) -> np.ndarray:
        """Length over which the band turns at each node [m], shape (nodes,).

        Clamps and hand turn it by shear within a diameter. Euler and Bernoulli's beam, which knows
        no shear, would keep a taut band from stretching for nearly a diameter on each side.
        """
        turns = self.shares.copy()
        ends = [0, self.middle, -1]
        turns[ends] = np.maximum(turns[ends], TURN * self.diameter)
        return turns

    @cached_property
    def stiffness(self) -> float:
        """Tension per nominal stress of the law [N/MPa]."""
        return self.rubber.scale * np.pi / 4 * self.diameter**2

    @cached_property
    def bending(self) -> float:
        """EI of a solid round band [N m2]."""
        return self.rubber.scale * self.rubber.law.modulus * np.pi / 64 * self.diameter**4

    @cached_property
    def masses(self) -> np.ndarray:
        """Of the nodes, shape (nodes,)."""
        masses = self.mass / self.length * self.shares
        masses[self.middle] += self.payload
        return masses

    def state(self, x: np.ndarray, memory: np.ndarray | None = None) -> np.ndarray:
        """At rest at the nodes x (nodes, 3, ...).

        Args:
            memory: Ratios (M,), see `Rubber.remembering`; None: as if held there for ever.
        """
        ratios = np.ones(self.rubber.memories) if memory is None else memory
        y = np.zeros((self.nodes, 6 + len(ratios), *x.shape[2:]))
        y[:, :3] = x
        if len(ratios):
            y[:-1, 6:] = self.rubber.remembering(self.stretch(x), ratios)
        return y

    def stretch(self, x: np.ndarray) -> np.ndarray:
        """Of each edge, shape (edges, ...)."""
        return np.linalg.norm(x[1:] - x[:-1], axis=1) / self.sizes.reshape(-1, *(1,) * (x.ndim - 2))

    def forces(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of states (nodes, 6 + M, ...): node forces (nodes, 3, ...) [N], rates of the memories."""
        rubber, ones = self.rubber, (1,) * (y.ndim - 2)
        sizes, weight = self.sizes.reshape(-1, *ones), self.bending / self.turns
        x, v = y[:, :3], y[:, 3:6]
        slope = (x[1:] - x[:-1]) / sizes[:, None]  # x_s
        turning = (v[1:] - v[:-1]) / sizes[:, None]
        stretch = np.sqrt(np.einsum("ij...,ij...->i...", slope, slope))
        along = slope / stretch[:, None]
        stress, tangent, forgetting = rubber.response(stretch, y[:-1, 6:])
        rate = np.einsum("ij...,ij...->i...", along, turning)
        tension = self.stiffness * (stress + rubber.viscosity * tangent * rate)

        clamp = np.broadcast_to(self.clamp_direction.reshape(1, 3, *ones), (1, *slope.shape[1:]))
        swing = (turning - rate[:, None] * along) / stretch[:, None]  # of the tangents
        bent = np.concatenate([clamp, along + rubber.viscosity * swing, -clamp])
        moment = weight.reshape(-1, 1, *ones) * (bent[1:] - bent[:-1])
        lever = (moment[1:] - moment[:-1]) / (sizes * stretch)[:, None]
        across = lever - np.einsum("ij...,ij...->i...", along, lever)[:, None] * along
        pull = tension[:, None] * along - across

        wind = v[1:] + v[:-1]
        wind -= np.einsum("ij...,ij...->i...", along, wind)[:, None] * along  # twice the air across
        speed = np.sqrt(np.einsum("ij...,ij...->i...", wind, wind))
        side = self.diameter * sizes * np.sqrt(stretch)  # volume is kept: d ~ stretch^-1/2
        wind *= (AIR_DENSITY * CYLINDER_DRAG / 16 * side * speed)[:, None]  # on each end

        force = np.empty_like(bent, shape=x.shape)
        force[1:-1] = pull[1:] - pull[:-1] - wind[1:] - wind[:-1]
        force[0], force[-1] = pull[0] - wind[0], -pull[-1] - wind[-1]
        masses = self.masses.reshape(-1, 1, *ones)
        force += masses * (GRAVITY.reshape(3, *ones) - self.damping * v)
        return force, forgetting

    def rates(self, y: np.ndarray, time: float = 0.0, hand: Hand | None = None) -> np.ndarray:
        """dY/dt of states (nodes, 6 + M, ...); `hand` holds the middle node."""
        force, forgetting = self.forces(y)
        rates = np.zeros_like(y)
        rates[1:-1, :3] = y[1:-1, 3:6]
        rates[1:-1, 3:6] = force[1:-1] / self.masses[1:-1].reshape(-1, 1, *(1,) * (y.ndim - 2))
        rates[:-1, 6:] = forgetting
        if hand is not None:
            place, velocity = y[self.middle, :3], y[self.middle, 3:6]
            rates[self.middle, 3:6] = hand(time, place, velocity, force[self.middle])
        return rates

    def at_middle(self, y: np.ndarray) -> np.ndarray:
        """Force of the band on what holds its middle, shape (..., 3) [N].

        The middle node's inertia is not in it: it moves with the hand. States (..., nodes, 6 + M).
        """
        force = np.moveaxis(self.forces(np.moveaxis(y, (-2, -1), (0, 1)))[0], (0, 1), (-2, -1))
        return force[..., self.middle, :]

    def integrate(
        self,
        y: np.ndarray,
        times: np.ndarray,
        tolerance: float,
        *,
        hand: Hand | None = None,
        event: Callable[[float, np.ndarray], float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Follow the state y (nodes, 6 + M) from times[0], where it holds.

        Args:
            times: To report at, ascending, shape (S,).
            tolerance: Relative; a hundredth of it in m, m/s, and MPa of the law.
            hand: What holds the middle node, if anything.
            event: Ends the integration where it falls through zero.

        Returns:
            Times (R,) and states (R, nodes, 6 + M): those asked for, up to the event and with it.
        """
        shape = y.shape
        reach = 2 * shape[1] + 5  # two nodes on, from the first of x to the last of v
        columns, width = np.arange(y.size), 2 * reach + 1
        nudges = NUDGE * np.equal.outer(columns % width, np.arange(width))
        rows = columns + np.arange(-reach, reach + 1)[:, None]  # (band, column)
        outside = (rows < 0) | (rows >= y.size)
        places = np.where(outside, 0, rows * width + columns % width)

        def rates(t: float, flat: np.ndarray) -> np.ndarray:
            return self.rates(flat.reshape(shape), t, hand).ravel()

        def jacobian(t: float, flat: np.ndarray) -> np.ndarray:
            """Banded, by differences: columns of one colour share no row."""
            moved = (flat[:, None] + nudges).reshape(*shape, -1)
            change = self.rates(moved, t, hand).reshape(y.size, -1) - rates(t, flat)[:, None]
            found = change.take(places)
            found[outside] = 0.0
            return found / NUDGE

        stop = None if event is None else Falling(lambda t, flat: event(t, flat.reshape(shape)))
        solution = solve_ivp(
            rates,
            (times[0], times[-1]),
            y.ravel(),
            method="LSODA",
            t_eval=times,
            events=stop,
            jac=jacobian,
            lband=reach,
            uband=reach,
            rtol=tolerance,
            atol=tolerance / 100,
        )
        if solution.status < 0:
            raise RuntimeError(f"the band's integration failed: {solution.message}")
        found, states = solution.t, solution.y.T
        if solution.status == 1:
            found = np.append(found, solution.t_events[0])
            states = np.vstack([states, solution.y_events[0]])
        return found, states.reshape(-1, *shape)

    def at_rest(
        self,
        x: np.ndarray,
        tolerance: float,
        *,
        held: bool = False,
        give: float = 0.0,
        memory: np.ndarray | None = None,
    ) -> np.ndarray:
        """The state in which the band comes to rest from nodes x (nodes, 3).

        Args:
            held: The middle stays where it is.
            give: By how much what holds the middle gives way to the band's force [m/N].
            memory: Ratios (M,) of every edge, see `Rubber.remembering`; None: all is relaxed.
        """
        frozen, kept = self.rubber.frozen(memory)
        sticky = replace(self, rubber=frozen, damping=2 * np.sqrt(-GRAVITY[2] / (self.length / 2)))
        if held and (nodes := sticky.balanced(x, kept, tolerance / 100, give)) is not None:
            return self.state(nodes, memory)
        start, hand = sticky.state(x, kept), still if held else None
        end = sticky.integrate(start, np.array([0.0, SETTLING_TIME]), tolerance, hand=hand)[1][-1]
        return self.state(end[:, :3], memory)

    def balanced(
        self, start: np.ndarray, memory: np.ndarray, tolerance: float, give: float = 0.0
    ) -> np.ndarray | None:
        """Nodes near `start` (nodes, 3) that no force moves; see statics.py.

        Clamps and the memories' ratios (M,) stay, and the middle but for what it gives way [m/N].
        """

        def forces(x: np.ndarray) -> np.ndarray:
            force = self.forces(self.state(x, memory))[0]
            if give:
                force[self.middle] -= (x[self.middle] - start[self.middle, :, None]) / give
            return force

        held = [0, -1] if give else [0, self.middle, -1]
        return balanced(forces, start, held, tolerance)

    def energy(self, y: np.ndarray) -> float:
        """Motion, height, strain and bending of one state [J]; not what relaxing branches hold."""
        x, v = y[:, :3], y[:, 3:6]
        slope = (x[1:] - x[:-1]) / self.sizes[:, None]
        along = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        turn = np.diff(np.vstack([self.clamp_direction, along, -self.clamp_direction]), axis=0)
        return float(
            np.sum(self.masses[:, None] * (v**2 / 2 - GRAVITY * x))
            + self.stiffness * np.sum(self.sizes * self.rubber.stored(self.stretch(x), y[:-1, 6:]))
            + self.bending / 2 * np.sum(turn**2 / self.turns[:, None])
        )
