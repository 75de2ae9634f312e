"""A plan as files: samples as CSV, commands of the gripper as ROS 2 messages in JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable

import numpy as np

from sling2sim2real.cli.plan.trajectory import Trajectory
from sling2sim2real.recording.transforms import Transform

COLUMNS = (
    "t x y z qx qy qz qw vx vy vz ax ay az opening phase".split()  # s, m, m/s, m/s^2; robot's base
)


def csv_text(trajectory: Trajectory, base: Transform, hand: np.ndarray, rate: float) -> str:
    """Samples at `rate` [Hz] from the first to the last moment, in the robot's base.

    Args:
        base: Frame O to the base.
        hand: Quaternion of the hand in the base, x, y, z, w.
    """
    time = np.arange(int(np.ceil(trajectory.duration * rate - 1e-9)) + 1) / rate
    rows = np.column_stack(
        [
            time,
            base.apply(trajectory.position(time)),
            np.tile(hand, (len(time), 1)),
            base.rotation.apply(trajectory.position(time, 1)),
            base.rotation.apply(trajectory.position(time, 2)),
            trajectory.opening(time),
        ]
    )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row, phase in zip((rows + 0.0).round(9).tolist(), trajectory.phase_at(time), strict=True):
        writer.writerow([*(f"{value:.9g}" for value in row), phase])
    return text.getvalue()


def gripper_commands(
    trajectory: Trajectory, position: Callable[[float], float], force: float
) -> list[dict]:
    """control_msgs/GripperCommand with the time of each: open, close, open.

    Args:
        position: What the gripper takes as `position` for a distance between the fingers [m].
        force: Of each finger [N], as `max_effort`.
    """
    moments = [(0.0, trajectory.openings[0])]
    for phase, start in zip(trajectory.phases, trajectory.times, strict=False):
        if phase.opening != moments[-1][1]:
            moments.append((start, phase.opening))
    return [
        {
            "time_from_start": _duration(time),
            "command": {"position": position(float(opening)), "max_effort": float(force)},
        }
        for time, opening in moments
    ]


def _duration(time: float) -> dict[str, int]:
    seconds, nanoseconds = divmod(round(float(time) * 1e9), 10**9)
    return {"sec": seconds, "nanosec": nanoseconds}
