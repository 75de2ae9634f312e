"""The forces on a band's nodes, compiled: see string.py for what they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rig.physics.compiled import compiled
from rig.physics.rubber import Material, respond
from rig.physics.servo import Servo, acceleration

NUDGE = 1e-7  # of the difference quotients, in m, m/s, and MPa of the law
NEAR = 2  # nodes to each side that a node feels


class BandNumbers(NamedTuple):
    """What compiled code reads of an `ElasticString`.

    Attributes:
        sizes: Of the edges [m].
        masses: Of the nodes [kg].
        bending: EI over the length of each node's turn [N m].
        clamp: Direction of the band at the clamps (3,).
        stiffness: Tension per stress of the law [N/MPa].
        viscosity: eta [s].
        damping: By mass [1/s].
        drag: Half the force per length of an unstretched edge, by the square of twice its speed.
        gravity: (3,) [m/s2].
        material: Of the rubber.
    """

    sizes: np.ndarray
    masses: np.ndarray
    bending: np.ndarray
    clamp: np.ndarray
    stiffness: float
    viscosity: float
    damping: float
    drag: float
    gravity: np.ndarray
    material: Material


@compiled
def across(vector: np.ndarray, along: np.ndarray) -> None:
    """Take out of a vector (3,) what lies along a unit vector."""
    part = vector[0] * along[0] + vector[1] * along[1] + vector[2] * along[2]
    for c in range(3):
        vector[c] -= part * along[c]


@compiled
def forces(y: np.ndarray, force: np.ndarray, forgetting: np.ndarray, band: BandNumbers) -> None:
    """Write node forces (nodes, 3) [N] and rates of the memories (edges, M) of a state."""
    edges = len(band.sizes)
    along, bent = np.empty((edges, 3)), np.empty((edges + 2, 3))
    stretch, tension, moment = np.empty(edges), np.empty(edges), np.empty((edges + 1, 3))
    bent[0], bent[edges + 1] = band.clamp, -band.clamp
    turning, memory = np.empty(3), y[:, 6:]
    for e in range(edges):
        square = rate = 0.0
        for c in range(3):
            slope = (y[e + 1, c] - y[e, c]) / band.sizes[e]  # x_s
            along[e, c] = slope
            square += slope * slope
        stretch[e] = np.sqrt(square)
        for c in range(3):
            along[e, c] /= stretch[e]
            turning[c] = (y[e + 1, 3 + c] - y[e, 3 + c]) / band.sizes[e]
            rate += along[e, c] * turning[c]
        stress, tangent = respond(e, stretch[e], memory, forgetting, band.material)
        tension[e] = band.stiffness * (stress + band.viscosity * tangent * rate)
        for c in range(3):
            swing = (turning[c] - rate * along[e, c]) / stretch[e]  # of the tangent
            bent[e + 1, c] = along[e, c] + band.viscosity * swing
    for i in range(edges + 1):
        for c in range(3):
            moment[i, c] = band.bending[i] * (bent[i + 1, c] - bent[i, c])
            force[i, c] = band.masses[i] * (band.gravity[c] - band.damping * y[i, 3 + c])
    lever, wind = np.empty(3), np.empty(3)
    for e in range(edges):
        for c in range(3):
            lever[c] = (moment[e + 1, c] - moment[e, c]) / (band.sizes[e] * stretch[e])
            wind[c] = y[e + 1, 3 + c] + y[e, 3 + c]  # twice the air's
        across(lever, along[e])
        across(wind, along[e])
        speed = np.sqrt(wind[0] ** 2 + wind[1] ** 2 + wind[2] ** 2)
        drag = band.drag * band.sizes[e] * np.sqrt(stretch[e]) * speed  # volume is kept
        for c in range(3):
            pull = tension[e] * along[e, c] - lever[c]
            force[e, c] += pull - drag * wind[c]
            force[e + 1, c] -= pull + drag * wind[c]


@compiled
def middle_forces(states: np.ndarray, band: BandNumbers) -> np.ndarray:
    """Forces on the middle node in states (S, nodes, 6 + M), shape (S, 3) [N]."""
    nodes = len(band.masses)
    force, forgetting = np.empty((nodes, 3)), np.empty((nodes, states.shape[2] - 6))
    result = np.empty((len(states), 3))
    for i in range(len(states)):
        forces(states[i], force, forgetting, band)
        result[i] = force[nodes // 2]
    return result


@compiled
def change(time: float, y: np.ndarray, out: np.ndarray, band: BandNumbers, hand: Servo) -> None:
    """Write dY/dt of a state (nodes, 6 + M)."""
    nodes = len(band.masses)
    middle, force = nodes // 2, np.empty((nodes, 3))
    forces(y, force, out[:, 6:], band)
    out[nodes - 1, 6:] = 0.0
    for i in range(nodes):
        free = 0 < i < nodes - 1
        for c in range(3):
            out[i, c] = y[i, 3 + c] if free else 0.0
            out[i, 3 + c] = force[i, c] / band.masses[i] if free else 0.0
    if hand.mass > 0:
        out[middle, 3:6] = acceleration(time, y[middle], force[middle], hand)


@compiled
def rates(time: float, y: np.ndarray, out: np.ndarray, data: tuple[BandNumbers, Servo]) -> None:
    """`change` of a flat state, as CVODE asks for it."""
    band, hand = data[0], data[1]
    shape = len(band.masses), len(y) // len(band.masses)
    change(time, y.reshape(shape), out.reshape(shape), band, hand)


@compiled
def slopes(
    time: float, y: np.ndarray, jacobian: np.ndarray, data: tuple[BandNumbers, Servo]
) -> None:
    """Write the Jacobian of `rates` by differences: nodes of one colour share no neighbour.

    Shape (nodes, 2 NEAR + 1, 6 + M, 6 + M): of row r of node i by row c of node i + o - NEAR.
    """
    band, hand = data[0], data[1]
    nodes, colours, width = jacobian.shape[:3]
    moved = y.copy().reshape((nodes, width))
    base, nudged = np.empty((nodes, width)), np.empty((nodes, width))
    change(time, moved, base, band, hand)
    for c in range(width):
        for colour in range(colours):
            moved[colour::colours, c] += NUDGE
            change(time, moved, nudged, band, hand)
            for j in range(colour, nodes, colours):
                moved[j, c] = y[j * width + c]
                for i in range(max(j - NEAR, 0), min(j + NEAR + 1, nodes)):
                    for r in range(width):
                        slope = (nudged[i, r] - base[i, r]) / NUDGE
                        jacobian[i, j - i + NEAR, r, c] = slope
