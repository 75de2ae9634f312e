"""The band's force on the gripper: the raw force less the tool, bias and drift, in frame O."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.base.errors import UserError
from pipeline.recording.events import LEAD_IN, MARGIN, SETTLE, Release
from pipeline.recording.tool import Wrench

MOST_ASKEW = np.deg2rad(30.0)  # between the held force and the way to the fork
MOST_DRIFT = 0.05  # of the held force: more is no drift of the sensor
STRAIGHT = np.deg2rad(1.0)  # of a hand whose weight, if unknown, may be compared with the lead-in's


@dataclass(frozen=True)
class BandForce:
    """What the band does to the gripper.

    Attributes:
        values: Frame O, shape (S, 3) [N].
        flipped: The sensor reports the force of the gripper on the band.
        hold: Mean just before the release, shape (3,) [N].
        bias, drift: What was taken away beside the tool's load, in frame O [N], [N/s].
    """

    values: np.ndarray
    flipped: bool
    hold: np.ndarray
    bias: np.ndarray
    drift: np.ndarray


def band_force(
    wrench: Wrench, hand: np.ndarray, tool: object | None, grasp: float, release: Release
) -> BandForce:
    """Take the tool, the bias and the drift from a raw force, and find its sign.

    Args:
        hand: Where it lets go, frame O, shape (3,).
        tool: setup.tool, whose load `wrench` has, or None.

    Raises:
        UserError: where the lead-in is too short, or the held force does not point to the fork.
    """
    t = wrench.time
    held = (t > release.time - 0.5) & (t < release.time - MARGIN / 5)
    if not held.any():
        raise UserError(f"no force in the half second before the release at {release.time:.3f} s")
    force, bias, drift = _tared(wrench, 1.0, grasp, release)
    sign = _sign(force[held].mean(axis=0), hand)
    if sign < 0 and tool is not None:  # the sensor feels its tool with the other sign, too
        force, bias, drift = _tared(wrench, sign, grasp, release)
        if _sign(force[held].mean(axis=0), hand) > 0:
            raise UserError(
                f"a tool of {tool.mass:.3g} kg hides which sign the force has: check setup.tool and"
                " the wrench's frame"
            )
    force = sign * force
    return BandForce(force, sign < 0, force[held].mean(axis=0), bias, drift)


def _tared(
    wrench: Wrench, sign: float, grasp: float, release: Release
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The band's force in frame O (S, 3), with the sensor's sign, and the bias and drift in it.

    Taken away are the tool's load, then, in the sensor's frame, the lead-in's mean and the drift
    until the free hand at the end.
    """
    t, rest = wrench.time, wrench.raw - sign * wrench.load
    lead_in = t < grasp - MARGIN
    if lead_in.sum() < 20 or grasp - MARGIN - t[0] < LEAD_IN:
        raise UserError(
            f"the band is grasped {grasp - t[0]:.2f} s after the start: record at least"
            f" {LEAD_IN + MARGIN:.2f} s of the empty hand before, to tare the force"
        )
    bias = rest[lead_in].mean(axis=0)
    turn, end = wrench.turn[lead_in].mean(), t > release.time + SETTLE
    if not wrench.load.any():
        end &= (turn.inv() * wrench.turn).magnitude() < STRAIGHT
    drift = np.zeros(3)
    if end.sum() >= 20:
        late = rest[end].mean(axis=0) - bias
        if np.linalg.norm(late) < MOST_DRIFT * release.drop:
            drift = late / (t[end].mean() - t[lead_in].mean())
    force = rest - bias - drift * (t - t[lead_in].mean())[:, None]
    return wrench.turn.apply(force), turn.apply(bias), turn.apply(drift)


def _sign(hold: np.ndarray, hand: np.ndarray) -> float:
    """+1, or -1 where the sensor reports the force of the gripper on the band."""
    if hand[1] > -0.05:
        raise UserError(
            f"the hand lets go at y = {hand[1]:+.3f} m, not behind the fork: check base_to_fork"
        )
    cosine = hold @ -hand / (np.linalg.norm(hold) * np.linalg.norm(hand))
    angle = np.arccos(np.clip(abs(cosine), 0, 1))
    if angle > MOST_ASKEW:
        raise UserError(
            f"the held force points {np.degrees(angle):.0f} degrees away from the fork: check the"
            " frame of the wrench and its transform to the hand in /tf_static"
        )
    return 1.0 if cosine > 0 else -1.0
