"""The band's force on the gripper: the raw force less the tool, bias and drift, in frame O."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.geometry import Geometry
from sling2sim2real.recording.grasp import LEAST_LEAD_IN, MARGIN
from sling2sim2real.recording.motion import Motion
from sling2sim2real.recording.release import SETTLE, Release
from sling2sim2real.recording.zero import Drift, drift_of
from sling2sim2real.settings.lab import Tool

GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2, frame O
MOST_ASKEW = np.deg2rad(30.0)  # between the held force and the way to the fork
STRAIGHT = np.deg2rad(1.0)  # of a hand whose weight, if unknown, may be compared with the lead-in's


@dataclass(frozen=True)
class BandForce:
    """What the band does to the gripper.

    Attributes:
        values: Frame O, shape (S, 3) [N].
        flipped: The sensor reports the force of the gripper on the band.
        hold: Mean just before the release, shape (3,) [N].
        bias, drift: What was taken away beside the tool's load, in frame O [N], [N/s].
        zero: How the zero moved, in frame O.
    """

    values: np.ndarray
    flipped: bool
    hold: np.ndarray
    bias: np.ndarray
    drift: np.ndarray
    zero: Drift


def band_force(
    t: np.ndarray,
    raw: np.ndarray,
    motion: Motion,
    geometry: Geometry,
    tool: Tool | None,
    grasp: float,
    release: Release,
) -> BandForce:
    """Take the tool, the bias and the drift from a raw force, and find its sign.

    Taken away are the tool's load, then, in the sensor's frame, the lead-in's mean and the drift
    until the free hand at the end where that is steady (`zero`).

    Args:
        t: Times [s], shape (S,).
        raw: The wrench's frame, shape (S, 3) [N].
        tool: None where it is not known.
        grasp: Time [s].

    Raises:
        UserError: where the lead-in is too short, or the held force does not point to the fork.
    """
    load = np.zeros_like(raw)
    if tool is not None:
        center = np.array(tool.center)
        load = tool.mass * load_per_mass(motion, geometry, t, center, jump=release.time)
    turn, hand = sensor_turns(motion, geometry, t), motion.position(release.time)
    held = (t > release.time - 0.5) & (t < release.time - MARGIN / 5)
    lead_in, end = t < grasp - MARGIN, t > release.time + SETTLE
    if not held.any():
        raise UserError(f"no force in the half second before the release at {release.time:.3f} s")
    if lead_in.sum() < 20 or grasp - MARGIN - t[0] < LEAST_LEAD_IN:
        raise UserError(
            f"the band is grasped {grasp - t[0]:.2f} s after the start: record at least"
            f" {LEAST_LEAD_IN + MARGIN:.2f} s of the empty hand before, to tare the force"
        )
    usual = turn[lead_in].mean()  # pyright: ignore[reportArgumentType]

    def tared(sign: float) -> tuple[np.ndarray, np.ndarray, Drift]:
        """The force in frame O (S, 3), with the sensor's sign, and the bias and drift in it."""
        rest = raw - sign * load
        bias, late = rest[lead_in].mean(axis=0), end
        if not load.any():
            late = late & ((usual.inv() * turn).magnitude() < STRAIGHT)
        zero = drift_of(t, rest, lead_in, late, release.drop)
        force = rest - bias - zero.rate * (t - t[lead_in].mean())[:, None]
        return turn.apply(force), usual.apply(bias), zero.seen_from(usual)

    force, bias, zero = tared(1.0)
    sign = _sign(force[held].mean(axis=0), hand)
    if sign < 0 and tool is not None:  # the sensor feels its tool with the other sign, too
        force, bias, zero = tared(sign)
        if _sign(force[held].mean(axis=0), hand) > 0:
            raise UserError(
                f"a tool of {tool.mass:.3g} kg hides which sign the force has: check setup.tool and"
                " the wrench's frame"
            )
    force = sign * force
    return BandForce(force, sign < 0, force[held].mean(axis=0), bias, zero.rate, zero)


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


def sensor_turns(motion: Motion, geometry: Geometry, times: np.ndarray) -> Rotation:
    """The wrench's frame into frame O at times (T,): T rotations."""
    if geometry.sensor_is_fixed:
        return Rotation.from_quat(np.tile(geometry.sensor.rotation.as_quat(), (len(times), 1)))
    return motion.orientation(times) * geometry.sensor.rotation


def load_per_mass(
    motion: Motion,
    geometry: Geometry,
    times: np.ndarray,
    center: np.ndarray,
    *,
    gravity: np.ndarray = GRAVITY,
    jump: float | None = None,
) -> np.ndarray:
    """Force on the sensor of each kilogram of tool, gravity less acceleration [N/kg].

    Args:
        times: Shape (T,) [s].
        center: Of mass, in the wrench's frame [m], shape (3,); in the hand's frame where the
            wrench is given in one that does not move with the hand.
        gravity: Frame O [m/s^2]; 0 leaves the inertia alone.
        jump: When the acceleration may jump, because the hand starts back [s].

    Returns:
        Shape (T, 3), in the wrench's frame.
    """
    point = np.asarray(center) if geometry.sensor_is_fixed else geometry.sensor.apply(center)
    specific = gravity - motion.acceleration(times, point, jump)
    return sensor_turns(motion, geometry, times).inv().apply(specific)
