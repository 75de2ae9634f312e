"""The band as a string in 3-D: distributed mass, finite strain, relaxation, drag, a little bending.

    m x_tt = d/ds [T t - EI (1 + eta d/dt) P t_ss / |x_s|] + m g + drag,   T = A sigma(|x_s|, ...)

with s the reference length, t = x_s / |x_s| the tangent, P what lies across it, m the mass per s
and sigma from rubber.py. Bending acts on tangents, so that it does not feel how stretch changes.
Lumped masses on edges that are short near the clamps and the middle, where the band turns: second
order in space. Forces are in forces.py, time is left to SUNDIALS (integration.py).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from sksundae.cvode import CVODEPrecond

from rig.physics import forces
from rig.physics.forces import BandNumbers
from rig.physics.integration import integrated
from rig.physics.linear import Elimination
from rig.physics.rubber import Rubber
from rig.physics.servo import ABSENT, STILL, Servo
from rig.physics.statics import balanced

GRAVITY = np.array([0.0, 0.0, -9.81])
AIR_DENSITY = 1.2  # kg/m3
CYLINDER_DRAG = 1.1  # coefficient of a cylinder across the wind
SETTLING_TIME = 4.0
TURN = 1.0  # diameters, in which clamps and hand turn the band
GRADING = 0.75  # edges are 1 - GRADING to 1 + GRADING of their mean


@dataclass(frozen=True)
class ElasticString:
    """A band between two clamps.

    A state Y has a row a node: x (3), v (3) and the rubber's memories (M) of the edge that follows
    it (those of the last row mean nothing).

    Attributes:
        edges: Even, so that the middle is a node.
        length, diameter, mass: Of the free band at rest [m, m, kg].
        clamps: Both ends, shape (2, 3).
        clamp_direction: Unit vector along which the band leaves both clamps.
        rubber: The material.
        payload: Extra mass that the middle node carries [kg].
        damping: Of the motion, by mass [1/s]; 0 but for coming to rest.
        worst: Stretch to which the band was drawn before [1].
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
    worst: float = 1.0

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
        """Masses of the nodes, shape (nodes,)."""
        masses = self.mass / self.length * self.shares
        masses[self.middle] += self.payload
        return masses

    @cached_property
    def band(self) -> BandNumbers:
        """What compiled code reads."""
        return BandNumbers(
            sizes=self.sizes,
            masses=self.masses,
            bending=self.bending / self.turns,
            clamp=np.array(self.clamp_direction, float),
            stiffness=float(self.stiffness),
            viscosity=float(self.rubber.viscosity),
            damping=float(self.damping),
            drag=AIR_DENSITY * CYLINDER_DRAG / 16 * self.diameter,
            gravity=GRAVITY,
            material=self.rubber.material,
        )

    @cached_property
    def _near_middle(self) -> tuple[slice, BandNumbers]:
        """The nodes that the middle feels, and the band of these alone."""
        first, last = self.middle - forces.NEAR, self.middle + forces.NEAR
        nodes, band = slice(first, last + 1), self.band
        parts = {"masses": band.masses[nodes], "bending": band.bending[nodes]}
        return nodes, band._replace(sizes=band.sizes[first:last], **parts)

    def state(self, x: np.ndarray, memory: np.ndarray | None = None) -> np.ndarray:
        """State at rest at the nodes x (nodes, 3).

        Args:
            memory: Ratios (M,), see `Rubber.remembering`; None: as if held there for ever.
        """
        ratios = np.ones(self.rubber.memories) if memory is None else memory
        y = np.zeros((self.nodes, 6 + len(ratios)))
        y[:, :3] = x
        if len(ratios):
            y[:-1, 6:] = self.rubber.remembering(self.stretch(x), ratios)
        if self.rubber.softening is not None:
            before = self.rubber.law.energy(np.array(self.worst))
            y[:-1, -1] = np.maximum(y[:-1, -1], before)
        return y

    def stretch(self, x: np.ndarray) -> np.ndarray:
        """Stretch of each edge, shape (edges,)."""
        return np.linalg.norm(x[1:] - x[:-1], axis=1) / self.sizes

    def forces(self, y: np.ndarray) -> np.ndarray:
        """Forces on the nodes in a state (nodes, 6 + M), shape (nodes, 3) [N]."""
        force, forgetting = np.empty((self.nodes, 3)), np.empty((self.edges, y.shape[1] - 6))
        forces.forces(y, force, forgetting, self.band)
        return force

    def at_middle(self, y: np.ndarray) -> np.ndarray:
        """Force of the band on what holds its middle, shape (..., 3) [N].

        The middle node's inertia is not in it: it moves with the hand. States (..., nodes, 6 + M).
        """
        nodes, band = self._near_middle
        near = np.array(y[..., nodes, :])
        return forces.middle_forces(near.reshape(-1, *near.shape[-2:]), band).reshape(
            *y.shape[:-2], 3
        )

    def integrate(
        self,
        y: np.ndarray,
        times: np.ndarray,
        tolerance: float,
        *,
        hand: Servo = ABSENT,
        event: Callable[[float, np.ndarray], float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Follow the state y (nodes, 6 + M) from times[0], where it holds.

        Args:
            times: To report at, ascending, shape (S,), three at least.
            tolerance: Relative; a hundredth of it in m, m/s, and MPa of the law.
            hand: What holds the middle node.
            event: Ends the integration where it falls through zero.

        Returns:
            Times (R,) and states (R, nodes, 6 + M): those asked for, up to the event and with it.
        """
        shape, newton = y.shape, Elimination(*y.shape)

        def value(time: float, flat: np.ndarray, out: np.ndarray, data: object) -> None:
            out[0] = event(time, flat.reshape(shape))  # pyright: ignore[reportOptionalCall]

        times_there, states = integrated(
            forces.rates,
            y.ravel(),
            times,
            (self.band, hand),
            tolerance,
            tolerance / 100,
            event=event and value,
            linsolver="gmres",
            precond=CVODEPrecond(newton.setup, newton.solve),
        )
        return times_there, states.reshape(-1, *shape)

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
        frozen, memory_ratios = self.rubber.frozen(memory)
        sticky = replace(self, rubber=frozen, damping=2 * np.sqrt(-GRAVITY[2] / (self.length / 2)))
        if held and (nodes := sticky.balanced(x, memory_ratios, tolerance / 100, give)) is not None:
            return self.state(nodes, memory)
        times, hand = np.array([0, 0.5, 1]) * SETTLING_TIME, STILL if held else ABSENT
        end = sticky.integrate(sticky.state(x, memory_ratios), times, tolerance, hand=hand)[1][-1]
        return self.state(end[:, :3], memory)

    def balanced(
        self, start: np.ndarray, memory: np.ndarray, tolerance: float, give: float = 0.0
    ) -> np.ndarray | None:
        """Nodes near `start` (nodes, 3) that no force moves; see statics.py.

        Clamps and the memories' ratios (M,) stay, and the middle but for what it gives way [m/N].
        """

        def forces(x: np.ndarray) -> np.ndarray:
            force = self.forces(self.state(x, memory))
            if give:
                force[self.middle] -= (x[self.middle] - start[self.middle]) / give
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
