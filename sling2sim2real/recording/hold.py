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

HAND_ERROR = 0.005  # m: of the tool centre point, and of the grip along the band
ASIDE = 2.0  # times as much an error turns the resultant in the strands' plane as out of it
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
    pull = _pull(scene, hand)
    along = pull / np.linalg.norm(pull)
    up = np.cross(*(scene.tips[::-1] - hand))
    up = up / np.linalg.norm(up) * (1.0 if up[2] >= 0 else -1.0)
    across = np.cross(along, up)
    unsteady = not facts.zero_steady and facts.zero_change  # while held it is somewhere up to that
    zero = float(np.hypot(facts.zero_error, np.linalg.norm(unsteady or 0.0)))
    place = HAND_ERROR / float(np.linalg.norm(hand)) * np.array([1.0, ASIDE])
    sag = WEIGHT_ERROR * float(np.linalg.norm(half)) / size * np.array([1.0, 0.0])
    weight, weight_error = None, np.inf
    if weighed:
        weight, weight_error = _weight(signals, scene, band.mass, np.hypot(zero, CREEP * size))
    area = np.pi * band.diameter**2 / 4
    return Hold(
        size=size,
        lift=float(force @ up),
        aside=float(force @ across),
        angles=np.arcsin(np.clip([force @ up / size, force @ across / size], -1, 1)),
        errors=np.sqrt(place**2 + sag**2 + FRAME_ERROR**2 + (zero / size) ** 2),
        modulus=float(force @ along / (area * np.linalg.norm(pull))),
        weight=weight,
        weight_error=weight_error,
    )


def _pull(scene: Scene, hand: np.ndarray) -> np.ndarray:
    """Pull of both strands on the hand, for a modulus and an area of 1, shape (3,)."""
    ways = scene.tips - hand
    lengths = np.linalg.norm(ways, axis=1)
    stretch = lengths / (scene.rest_length / 2)
    stress = (stretch - stretch**-2.0).clip(0.01) / 3  # neo-Hookean, over Young's modulus
    return (stress / lengths) @ ways


def _weight(signals: Signals, scene: Scene, mass: float, zero: float) -> tuple[float | None, float]:
    """How heavy the slack band is on the hand, over its whole weight, and the error of that.

    Args:
        zero: Standard deviation of the force's zero [N].
    """
    times = signals.time
    slack = (times > signals.grasp_time + AFTER_GRASP) & (times < signals.release_time)
    slack &= np.array([scene.stretch(time) for time in times]) < SLACK
    if slack.sum() < LEAST_SLACK:
        return None, np.inf
    heavy, force = mass * float(np.linalg.norm(GRAVITY)), signals.force[slack, 2]
    error = np.hypot(zero, force.std() / np.sqrt(LEAST_SLACK))
    return float(-force.mean() / heavy), float(error / heavy)
