"""The held force against what a drawn band can do: its direction, its weight and its stiffness.

A drawn band is two straight strands from the hand to the tips. It pulls the hand in their plane,
along their resultant, and down by half of its weight. Its material is some rubber.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.recording.force import GRAVITY
from sling2sim2real.recording.scene import Scene
from sling2sim2real.recording.signals import Signals
from sling2sim2real.settings.lab import BandParams

HAND_ERROR, GRIP_ERROR = 0.005, 0.005  # m: of the tool centre point; of the grip along the band
FRAME_ERROR = np.deg2rad(0.5)  # of a sensor that is mounted and calibrated well
WEIGHT_ERROR = 0.3  # of half the weight, by sag and a band that is not alike all along
CREEP = 0.002  # of the held force, that a zero may be off meanwhile
SLACK = 0.9  # way over rest length, below which the band hangs in a bow
AFTER_GRASP = 0.3  # s
LEAST_SLACK = 10  # samples


@dataclass(frozen=True)
class Hold:
    """The force of the drawn band just before the release.

    Attributes:
        size: [N].
        lift, aside: Out of the strands' plane (up: positive), less half of the band's weight, and
            in it across their resultant (to the right: positive) [N].
        angles, errors: Of both, with standard deviations [rad], shape (2,).
        modulus: Young's modulus that a rubber would have [Pa].
        weight: Of the slack band on the hand, over the whole band's weight; None where the
            recording has no time for it, or the band was not weighed.
        weight_error: Its standard deviation.
    """

    size: float
    lift: float
    aside: float
    angles: np.ndarray
    errors: np.ndarray
    modulus: float
    weight: float | None
    weight_error: float


def hold_of(signals: Signals, scene: Scene, band: BandParams, weighed: bool = True) -> Hold:
    """Measure the hold of a pull whose band is drawn at the release.

    A band that was not weighed weighs nothing, which its stiffness hardly feels.
    """
    facts = signals.facts
    half = (band.mass if weighed else 0.0) * GRAVITY / 2
    hand = signals.hand(signals.release_time - 0.01)
    force = np.array(facts.hold_force) - half
    size = float(np.linalg.norm(force))
    up, along, across = _axes(scene, hand)
    angles = np.array([np.arcsin(np.clip(force @ way / size, -1, 1)) for way in (up, across)])
    # By how much the axes turn where the hand or the grip is elsewhere.
    spread = np.zeros(2)
    for axis in np.eye(3) * HAND_ERROR:
        moved = _axes(scene, hand + axis)[1]
        spread += np.array([moved @ up, moved @ across]) ** 2
    spread += np.array([0.0, _axes(scene, hand, GRIP_ERROR)[1] @ across]) ** 2
    zero = np.hypot(facts.zero_error, _unsure(facts.zero_change, facts.zero_steady))
    spread += FRAME_ERROR**2 + (zero / size) ** 2
    spread += np.array([WEIGHT_ERROR * float(np.linalg.norm(half)) / size, 0.0]) ** 2
    mass = band.mass if weighed else None
    weight, weight_error = _weight(signals, scene, mass, float(np.hypot(zero, CREEP * size)))
    area = np.pi * band.diameter**2 / 4
    return Hold(
        size=size,
        lift=float(force @ up),
        aside=float(force @ across),
        angles=angles,
        errors=np.sqrt(spread),
        modulus=float(force @ along / (area * np.linalg.norm(_pull(scene, hand)))),
        weight=weight,
        weight_error=weight_error,
    )


def _axes(
    scene: Scene, hand: np.ndarray, grip: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal of the strands' plane (up), their resultant, and across it in the plane (right)."""
    along = _pull(scene, hand, grip)
    along = along / np.linalg.norm(along)
    up = np.cross(*(scene.tips[::-1] - hand))
    up = up / np.linalg.norm(up) * (1.0 if up[2] >= 0 else -1.0)
    return up, along, np.cross(along, up)


def _pull(scene: Scene, hand: np.ndarray, grip: float = 0.0) -> np.ndarray:
    """Pull of both strands on the hand, for a modulus and an area of 1, shape (3,)."""
    ways = scene.tips - hand
    lengths = np.linalg.norm(ways, axis=1)
    stretch = lengths / (scene.rest_length / 2 + np.array([grip, -grip]))
    stress = (stretch - stretch**-2.0).clip(0.01) / 3  # neo-Hookean, over Young's modulus
    return (stress / lengths) @ ways


def _weight(
    signals: Signals, scene: Scene, mass: float | None, zero: float
) -> tuple[float | None, float]:
    """How heavy the slack band is on the hand, over its whole weight, and the error of that."""
    times = signals.time
    way = np.array([scene.stretch(time) for time in times])
    slack = (times > signals.grasp_time + AFTER_GRASP) & (times < signals.release_time)
    slack &= way < SLACK
    if slack.sum() < LEAST_SLACK or mass is None:
        return None, np.inf
    heavy = mass * float(np.linalg.norm(GRAVITY))
    force = signals.force[slack, 2]
    error = np.hypot(zero, force.std() / np.sqrt(LEAST_SLACK))
    return float(-force.mean() / heavy), float(error / heavy)


def _unsure(change: list[float] | None, steady: bool) -> float:
    """How far the zero while held may be from that before [N]: it is somewhere up to the change."""
    return 0.0 if steady or change is None else float(np.linalg.norm(change))
