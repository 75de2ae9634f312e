"""The recorded interaction in the rig's physics: hang, grasp, lift, pull, pause, slip, swing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rig.physics.motion import GRASP, HandMotion
from rig.physics.servo import Servo
from rig.physics.string import ElasticString
from rig.physics.world import bent_at
from sling2sim2real.base.errors import UserError

if TYPE_CHECKING:
    from pipeline.params import Params


@dataclass(frozen=True)
class Interaction:
    """What happened, frame O.

    Attributes:
        force: Of the band on the gripper at the sensor's times [N], shape (T, 3).
        hand: Of the tool centre point at the sensor's times [m], shape (T, 3).
        acceleration: Of the hand at the sensor's times [m/s2], shape (T, 3).
        seen: The camera's times [s], shape (K,).
        lines: Nodes of the band at those times [m], shape (K, nodes, 3).
        slip_time: When the band leaves the fingers [s].
    """

    force: np.ndarray
    hand: np.ndarray
    acceleration: np.ndarray
    seen: np.ndarray
    lines: np.ndarray
    slip_time: float


def hang(string: ElasticString, tolerance: float) -> np.ndarray:
    """Nodes of the band that hangs from its clamps, shape (nodes, 3)."""
    reach = np.linalg.norm(string.clamps[1] - string.clamps[0]) / 2
    depth = np.sqrt(max((string.length / 2) ** 2 - reach**2, 0.0))
    return string.at_rest(bent_at(string, np.array([0.0, 0.0, -depth])), tolerance)[:, :3]


def pull_and_release(
    string: ElasticString,
    hanging: np.ndarray,
    motion: HandMotion,
    sensor_times: np.ndarray,
    camera_times: np.ndarray,
    params: Params,
    progress: Callable[[str], None] = lambda line: None,
) -> Interaction:
    """Follow the band from rest through the motion.

    Args:
        hanging: Where the band hangs, shape (nodes, 3).
        sensor_times, camera_times: To report at [s], ascending, within the motion.

    Raises:
        UserError: The pads cannot hold the band.
    """
    rig = params.rig
    holding = 2 * rig.pads.friction * rig.pads.force  # two pads
    follow = Servo.of(rig.arm, motion.path)

    def margin(time: float, y: np.ndarray) -> float:
        grip = holding * float(motion.grip(time))
        return grip - float(np.linalg.norm(string.at_middle(y)))

    y = string.state(hanging)
    y[string.middle, :6] = np.concatenate([motion.position(GRASP), motion.position(GRASP, 1)])
    last = motion.opens + motion.opening[0]
    wanted = np.union1d(sensor_times, camera_times)
    during = wanted[(wanted > GRASP) & (wanted < last)]
    held_times, held = string.integrate(
        y, np.concatenate([[GRASP], during, [last]]), rig.tolerance, hand=follow, event=margin
    )
    held_times, held = held_times[1:], held[1:]  # the first shows the jolt of the grasp alone
    slip = float(held_times[-1])
    if slip < motion.opens:
        raise UserError(
            f"rig.pads.friction: {rig.pads.friction:g} lets the band slip out at {slip:.2f} s,"
            f" before the fingers open; raise it or rig.pads.force"
        )
    progress(f"held from {GRASP:.2f} s, slipped free at {slip:.4f} s")

    after = wanted[wanted > slip]
    ends = np.concatenate([[slip], after, [motion.end]])
    free = string.integrate(held[-1], ends, rig.tolerance)[1]
    hand = follow.alone(held[-1, string.middle, :6], np.concatenate([[slip], after]), rig.tolerance)
    hand = hand[1:]  # (x, v) after the slip

    force = np.zeros((len(sensor_times), 3))
    moving = np.hstack([motion.position(sensor_times, derivative) for derivative in (0, 1)])
    while_held, sensed = np.isin(sensor_times, held_times), np.isin(held_times, sensor_times)
    force[while_held] = string.at_middle(held[sensed])
    moving[while_held] = held[sensed, string.middle, :6]
    moving[sensor_times > slip] = hand[np.isin(after, sensor_times)]

    lines = np.repeat(hanging[None], len(camera_times), axis=0)
    lines[np.isin(camera_times, held_times)] = held[np.isin(held_times, camera_times), :, :3]
    lines[camera_times > slip] = free[1:-1][np.isin(after, camera_times), :, :3]
    return Interaction(
        force=force,
        hand=moving[:, :3],
        acceleration=follow.acceleration(sensor_times, moving, force),
        seen=camera_times,
        lines=lines,
        slip_time=slip,
    )
