"""What the pipeline takes from a message: one reader for each kind of schema.

ROS 2, ROS 1, Foxglove and Franka schemas differ in the names of fields and in where the stamp is;
here they become `Reading`s. Messages have attributes, whatever they were encoded as (`decode`).

Sources: ros2/common_interfaces, docs.foxglove.dev/docs/sdk/schemas, frankarobotics/franka_ros2
(FrankaRobotState) and frankarobotics/franka_ros (FrankaState).
"""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input.decode import Elsewhere, Message

LATEST = 2**62  # ns; a stamp beyond it is damage
MOVES = 0.3  # of the largest movement: joints that move less are no fingers, or another hand's
ALIKE = 0.9  # correlation of fingers that move as one
FRANKA_BASE = "franka_base"  # frame of Franka states whose header names none, as franka_ros writes


@dataclass(frozen=True)
class Picture:
    """What all image messages have in common.

    Attributes:
        encoding: Of raw pixels (rgb8, 16UC1, ...), "" where `data` is packed.
        format: Of packed data ("jpeg", "16UC1; compressedDepth png", ...), "" where it is raw.
        data: uint8, shape (bytes,).
        height, width: Pixels; 0 where packed, as are `step` and `is_bigendian`.
        step: Bytes a row, with its padding.
        stamp: Of its header, as it was recorded [ns].
    """

    encoding: str
    format: str
    data: np.ndarray
    height: int = 0
    width: int = 0
    step: int = 0
    is_bigendian: bool = False
    stamp: int = 0

    @property
    def kind(self) -> tuple[Hashable, ...]:
        """What all pictures of a topic have in common."""
        return self.encoding, self.format, self.height, self.width, self.step


class Reading(NamedTuple):
    """One message.

    Attributes:
        stamp: Of its header [ns]; None where the type has none.
        frame: frame_id, "" where there is none.
        value: wrench fx fy fz [N]; pose x y z [m] qx qy qz qw; gripper and joints: positions
            [rad, m]; a Picture; a Calibration.
    """

    stamp: int | None
    frame: str
    value: Any


def kind_of(schema: str) -> str:
    """The schema's own name: geometry_msgs/msg/PoseStamped, a.b.PoseStamped -> PoseStamped."""
    kind = re.split(r"[/.:]+", schema)[-1].removesuffix("_")  # which DDS adds
    return "WrenchStamped" if kind.endswith("WrenchStamped") else kind


def first_of(message: Message, *names: str) -> Message:
    """The first of these fields that the message has. Raises AttributeError."""
    for name in names:
        if hasattr(message, name):
            return getattr(message, name)
    raise AttributeError(f"none of the fields {', '.join(names)}")


def stamp_of(message: Message) -> int | None:
    """header.stamp (ROS) or timestamp (Foxglove) [ns]; None where there is neither."""
    header = getattr(message, "header", None)
    time = getattr(message, "timestamp", None) if header is None else header.stamp
    if time is None:
        return None
    if isinstance(time, str):  # RFC 3339, as protobuf's JSON has it
        stamp = int(np.datetime64(time.rstrip("Z"), "ns").astype(np.int64))
    else:
        seconds = first_of(time, "sec", "secs", "seconds")
        stamp = int(seconds) * 10**9 + int(first_of(time, "nanosec", "nsec", "nsecs", "nanos"))
    if not 0 <= stamp < LATEST:
        raise ValueError("a stamp outside of all time")
    return stamp


def frame_of(message: Message) -> str:
    header = getattr(message, "header", message)
    return printable(str(getattr(header, "frame_id", ""))).lstrip("/")


def read_wrench(message: Message) -> Reading:
    return _reading(message, _vector(getattr(message, "wrench", message).force))


def read_pose(message: Message) -> Reading:
    pose = getattr(message.pose, "pose", message.pose)  # PoseWithCovariance
    return _reading(message, pose_of(pose))


def read_state_pose(message: Message) -> Reading:
    """O_T_EE: a PoseStamped in FrankaRobotState, a column-major 4 x 4 in FrankaState."""
    pose = first_of(message, "o_t_ee", "O_T_EE")
    if hasattr(pose, "pose"):
        frame = frame_of(pose) or frame_of(message) or FRANKA_BASE
        return Reading(stamp_of(message), frame, pose_of(pose.pose))
    matrix = np.array(pose, float).reshape(4, 4).T
    if not np.allclose(matrix[:3, :3] @ matrix[:3, :3].T, np.eye(3), atol=1e-3):
        raise ValueError("O_T_EE has no rotation")
    turn = Rotation.from_matrix(matrix[:3, :3]).as_quat()
    value = (*map(float, matrix[:3, 3]), *map(float, turn))
    return Reading(stamp_of(message), frame_of(message) or FRANKA_BASE, value)


def read_state_wrench(message: Message) -> Reading:
    """O_F_ext_hat_K, the external force that the arm estimates, in the frame of O_T_EE."""
    wrench = first_of(message, "o_f_ext_hat_k", "O_F_ext_hat_K")
    if not hasattr(wrench, "wrench"):
        force = tuple(float(wrench[i]) for i in range(3))
        return Reading(stamp_of(message), frame_of(message) or FRANKA_BASE, force)
    frame = frame_of(wrench) or read_state_pose(message).frame
    return Reading(stamp_of(message), frame, _vector(wrench.wrench.force))


def fingers_reader(names: tuple[str, ...]) -> Callable[[Message], Reading]:
    """Positions of these joints: two fingers that each move half the opening, or one value."""
    read = joints_reader(names, "")
    return lambda message: read(message)._replace(frame=frame_of(message))


def opening_of(values: np.ndarray, topic: str, names: tuple[str, ...]) -> np.ndarray:
    """Opening of a hand, shape (S, 1), from the positions of its fingers (S, C).

    Fingers of a mirrored sign count the other way round, those that hardly move not at all. Raises
    UserError where the others do not move as one, as those of two hands.
    """
    moved = np.ptp(values, axis=0)
    counts = moved >= MOVES * moved.max()
    fingers = values[:, counts]
    if moved.max() == 0:
        return fingers.sum(axis=1, keepdims=True)
    likeness = np.corrcoef(fingers.T, values[:, np.argmax(moved)])[-1, :-1]
    if np.abs(likeness).min() < ALIKE:
        moving = ", ".join(name for name, counted in zip(names, counts, strict=True) if counted)
        raise UserError(f"{topic}: the joints {moving} do not move as the fingers of one hand")
    return (fingers * np.sign(likeness)).sum(axis=1, keepdims=True)


def joints_reader(names: tuple[str, ...], frame: str) -> Callable[[Message], Reading]:
    """Positions of these joints, in this order, of a robot whose root is `frame`.

    The reader raises ValueError for a message in which one is missing, Elsewhere for one in which
    all are: other devices may share the topic.
    """

    def read(message: Message) -> Reading:
        joints = joints_of(message)
        missing = [name for name in names if name not in joints]
        if missing and len(missing) == len(names):
            raise Elsewhere(f"joint {missing[0]} is missing")
        if missing:
            raise ValueError(f"joint {missing[0]} is missing")
        return Reading(stamp_of(message), frame, tuple(joints[name] for name in names))

    return read


def read_image(message: Message) -> Reading:
    """Image and foxglove.RawImage, CompressedImage and foxglove.CompressedImage."""
    data, stamp = _bytes(message.data), stamp_of(message) or 0
    if hasattr(message, "format"):
        packed = Picture("", str(message.format) or "unnamed", data, stamp=stamp)
        return _reading(message, packed)
    size = (int(message.height), int(message.width), int(message.step))
    swapped = bool(getattr(message, "is_bigendian", False))
    return _reading(message, Picture(str(message.encoding), "", data, *size, swapped, stamp))


def joints_of(message: Message) -> dict[str, float]:
    """Position of each joint, of JointState, foxglove.JointStates or a Franka state."""
    message = getattr(message, "measured_joint_state", message)
    if hasattr(message, "joints"):
        return {str(joint.name): float(joint.position) for joint in message.joints}
    return dict(zip(map(str, message.name), map(float, message.position), strict=True))


def pose_of(pose: Message) -> tuple[float, ...]:
    """x y z qx qy qz qw of a Pose."""
    return (*_vector(pose.position), *quaternion_of(pose.orientation))


def quaternion_of(turn: Message) -> tuple[float, ...]:
    """x y z w. Raises ValueError where it has no length."""
    quaternion = tuple(float(getattr(turn, axis)) for axis in "xyzw")
    if not sum(x * x for x in quaternion) > 1e-12:
        raise ValueError("the quaternion has no length")
    return quaternion


def _reading(message: Message, value: tuple[float, ...] | Picture) -> Reading:
    return Reading(stamp_of(message), frame_of(message), value)


def _vector(vector: Message) -> tuple[float, float, float]:
    return float(vector.x), float(vector.y), float(vector.z)


def _bytes(data: Message) -> np.ndarray:
    """Bytes, base64 as JSON has it, or a list of numbers, to uint8."""
    if isinstance(data, str):
        data = base64.b64decode(data, validate=True)
    if isinstance(data, bytes | bytearray | memoryview):
        return np.frombuffer(data, np.uint8)
    return np.asarray(data, np.uint8)
