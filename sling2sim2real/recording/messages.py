"""Messages: by their schema to attributes, and by their type to what the pipeline takes from them.

ROS 2, ROS 1, Foxglove and Franka schemas differ in the names of fields and in where the stamp is;
here they become `Reading`s. `READERS` is the one table of types: what is not in it is not kept.

Recorders that do not find the definitions write empty schemas, or names alone: standard types of
ROS 2 are known by name.

Sources: ros2/common_interfaces, docs.foxglove.dev/docs/sdk/schemas, frankarobotics/franka_ros2
(FrankaRobotState) and frankarobotics/franka_ros (FrankaState).
"""

from __future__ import annotations

import base64
import json
import os
import re
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice
from tempfile import TemporaryFile
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeVar

import numpy as np
import zstandard
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.camera import Calibration, Camera

HELD = 2**29  # bytes of raw messages that are held in memory: the others lie in a temporary file
TRIES = 9  # messages that are looked at to know a topic

MOST_BYTES = 2**25  # of one message: a raw 4K picture has less, JSON takes fifty times as much
LATEST = 2**62  # ns; a stamp beyond it is damage
MOVES = 0.3  # of the largest movement: joints that move less are no fingers, or another hand's
ALIKE = 0.9  # correlation of fingers that move as one
FRANKA_BASE = "franka_base"  # frame of Franka states whose header names none, as franka_ros writes
PACKED = b"\x28\xb5\x2f\xfd"  # of zstd; no header of CDR begins so
XCDR2 = range(0x06, 0x0C)  # second byte: OMG DDS-XTypes 1.3, table 60
PACKAGES = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs")
# What readers raise where fields are missing, of other types or beyond all bounds.
UNFIT = (AttributeError, LookupError, TypeError, ValueError, OverflowError)

Message = Any  # it has the attributes that its schema says, and whoever reads it finds out
Decoder = Callable[[bytes], Message]
Value = TypeVar("Value")
Edge = tuple[str, str]  # parent and child frame
NO_SCHEMA = Schema(id=0, data=b"", encoding="", name="")


class Spool:
    """Where raw messages are kept: in memory as long as they are few, then in a temporary file."""

    def __init__(self, held: int = HELD) -> None:
        self.room, self.size = held, 0
        self.file: Any = None

    def put(self, data: bytes) -> bytes | tuple[int, int]:
        """Keep a message; what `get` needs to find it."""
        self.room -= len(data)
        if self.room >= 0:
            return data
        self.file = self.file or TemporaryFile()  # noqa: SIM115 (it ends with the last message)
        place = self.size, len(data)
        self.file.write(data)
        self.size += len(data)
        return place

    def get(self, place: bytes | tuple[int, int]) -> bytes:
        if isinstance(place, bytes):
            return place
        self.file.flush()
        return os.pread(self.file.fileno(), place[1], place[0])


class Payloads(Sequence[bytes]):
    """Raw messages of one topic, in the order of the file."""

    def __init__(self, spool: Spool) -> None:
        self._spool = spool
        self._places: list[bytes | tuple[int, int]] = []

    def append(self, data: bytes) -> None:
        self._places.append(self._spool.put(data))

    def extend(self, others: Payloads) -> None:
        """Of the same spool."""
        self._places += others._places

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, number: Any) -> Any:
        return self._spool.get(self._places[number])


@dataclass
class Channel:
    """One topic with its raw messages, in the order of the file; those of no use are left empty."""

    topic: str
    schema: Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)  # ns
    payloads: Any = field(default_factory=list)


class Unreadable(Exception):
    """A message that cannot be read; it says why, in one line."""

    @classmethod
    def by(cls, error: Exception) -> Unreadable:
        return cls(str(error).partition("\n")[0] or type(error).__name__)


class Elsewhere(Unreadable):
    """A message of another publisher on the same topic."""


def decoder(channel: Channel) -> Decoder:
    """A function from payload to a message with attributes; it raises Unreadable.

    Raises:
        UserError: where the encoding is not known or the schema is bad, in one line.
    """
    schema = channel.schema
    by_name = channel.encoding == "cdr" and _says_nothing(schema)
    if not by_name and (schema.encoding, channel.encoding) not in DECODERS:
        supported = ", ".join(f"{a} with {b}" for a, b in DECODERS)
        what = f"schema {schema.encoding!r}" if schema.encoding else "no schema"
        raise UserError(
            f"topic {channel.topic}: {what} with messages {channel.encoding!r} cannot be read,"
            f" record one of: {supported}"
        )
    try:
        if by_name:
            read = _standard(schema.name)
        else:
            read = _compiled(schema.encoding, channel.encoding, schema.name, schema.data)
    except Exception as error:  # the parsers raise many kinds
        reason = Unreadable.by(error)
        raise UserError(f"topic {channel.topic}: bad schema {schema.name} ({reason})") from error

    def bounded(payload: bytes) -> Message:
        if len(payload) > MOST_BYTES:
            raise Unreadable("a message that is too long")
        try:
            return read(_plain(payload, MOST_BYTES) if channel.encoding == "cdr" else payload)
        except Exception as error:  # damaged bytes make the libraries raise anything
            raise Unreadable.by(error) from error

    return bounded


def _says_nothing(schema: Schema) -> bool:
    """Whether a schema is no more than the name of a standard type of ROS 2."""
    if not _is_standard(schema.name):
        return False
    if schema.encoding in ("", "omgidl"):  # of DDS, whose names of ROS types are as well known
        return True
    return schema.encoding == "ros2msg" and schema.data.strip() in (b"", schema.name.encode())


def readable(
    read: Callable[[bytes], Value], payloads: Iterable[bytes], most: int | None = TRIES
) -> tuple[list[Value], str]:
    """What the first messages say that can be read, and why the last of the others cannot be."""
    reasons = ["all are damaged"]

    def readings() -> Iterator[Value]:
        for payload in payloads:
            try:
                yield read(payload)
            except Unreadable as error:
                reasons.append(str(error))

    return list(islice(readings(), most)), reasons[-1]


def message_reader(decode: Decoder, read: Callable[[Message], Value]) -> Callable[[bytes], Value]:
    """Make a function from payload to what `read` takes of its message; it raises Unreadable."""

    def decoded(payload: bytes) -> Value:
        message = decode(payload)
        try:
            return read(message)
        except UNFIT as error:
            raise Unreadable.by(error) from error

    return decoded


@lru_cache(64)
def _compiled(kind: str, encoding: str, name: str, data: bytes) -> Decoder:
    return DECODERS[kind, encoding](Schema(id=1, name=name, encoding=kind, data=data))


def _ros(schema: Schema) -> Decoder:
    """Decoder by types of this schema alone, because recordings may mix versions of a type."""
    text = schema.data.decode()
    # As rosbags has it: with the `msg` that ROS 1 leaves out.
    name = re.sub("^([^/:]+)(/|::)([^/:]+)$", r"\1/msg/\3", schema.name).replace("::", "/")
    store = get_typestore(Stores.EMPTY)
    if schema.encoding == "ros2idl":  # one file a type: mcap.dev/spec/registry#ros2idl
        text = re.sub("^#.*$", "", text, flags=re.MULTILINE)  # rosbags does not know #include
        files = re.split(r"^=+\nIDL: .*\n", text, flags=re.MULTILINE)
        types = [get_types_from_idl(file) for file in files if file.strip()]
        store.register({key: value for some in types for key, value in some.items()})
    else:
        store.register(get_types_from_msg(text, name))
    store.get_msgdef(name)
    ros1 = schema.encoding == "ros1msg"
    read = store.deserialize_ros1 if ros1 else store.deserialize_cdr
    return lambda payload: read(payload, name)


def _protobuf(schema: Schema) -> Decoder:
    decode = DecoderFactory().decoder_for("protobuf", schema)
    if decode is None:
        raise ValueError("no schema of protobuf")
    return decode


def _json(schema: Schema) -> Decoder:
    """Decoder by the schema's name alone: fields are found by name, bytes are base64."""
    return lambda payload: json.loads(payload, object_hook=lambda fields: SimpleNamespace(**fields))


DECODERS: dict[tuple[str, str], Callable[[Schema], Decoder]] = {
    ("ros2msg", "cdr"): _ros,
    ("ros2idl", "cdr"): _ros,
    ("ros1msg", "ros1"): _ros,
    ("protobuf", "protobuf"): _protobuf,
    ("jsonschema", "json"): _json,
}


def _standard_name(schema: str) -> str:
    """a::msg::dds_::B_, as DDS has it, and a/B to a/msg/B."""
    package, kind = re.split("::|/", schema)[0], re.split("::|/", schema)[-1]
    return f"{package}/msg/{kind.removesuffix('_') if '::' in schema else kind}"


def _is_standard(schema: str) -> bool:
    """Whether it is the name of a standard type."""
    name = _standard_name(schema)
    return name.startswith(PACKAGES) and name in _store().fielddefs


def _standard(schema: str) -> Callable[[bytes], Any]:
    """Make a function from payload to message, of a standard type."""
    store, name = _store(), _standard_name(schema)
    return lambda payload: store.deserialize_cdr(payload, name)


def _plain(payload: bytes, most: int) -> bytes:
    """Return a message's CDR, unpacked where zstd packed it.

    Raises ValueError where it is XCDR2, or unpacks to more than `most` bytes. The length of what
    is not packed is not checked.
    """
    if payload[:4] == PACKED:  # ros2 bag record --compression-mode message
        with zstandard.ZstdDecompressor().stream_reader(payload) as stream:
            payload = stream.read(most + 1)
        if len(payload) > most:
            raise ValueError("a message that is too long")
    if len(payload) > 1 and not payload[0] and payload[1] in XCDR2:
        raise ValueError(
            "in XCDR2, record with a middleware that writes XCDR1, the default of ROS 2"
        )
    return payload


@lru_cache(1)
def _store() -> Typestore:
    return get_typestore(Stores.ROS2_HUMBLE)


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


def read_poses(message: Message) -> Reading:
    """foxglove.PosesInFrame of one pose. Raises ValueError of several."""
    (pose,) = message.poses
    return _reading(message, pose_of(pose))


def read_calibration(message: Message) -> Reading:
    """CameraInfo of ROS 2 (k, d, p) and ROS 1, foxglove.CameraCalibration (K, D, P)."""
    matrix = np.array(first_of(message, "k", "K"), float).reshape(3, 3)
    projection = np.array(first_of(message, "p", "P"), float)
    rectified = projection.reshape(3, 4)[:, :3] if projection.size == 12 else np.zeros((3, 3))
    distortion = np.array(first_of(message, "d", "D"), float).ravel()
    frame = frame_of(message)
    camera = Camera(int(message.width), int(message.height), matrix, distortion, frame)
    across, down = (max(1, int(getattr(message, f"binning_{axis}", 1))) for axis in "xy")
    roi = getattr(message, "roi", None)
    sides = (roi.x_offset, roi.y_offset, roi.width, roi.height) if roi else (0, 0, 0, 0)
    x, y, width, height = map(int, sides)
    model = str(message.distortion_model)
    value = Calibration(camera, model, rectified, (across, down), (x, y, width, height))
    return Reading(stamp_of(message), frame, value)


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


def edges_of(message: Message) -> list[tuple[Edge, np.ndarray]]:
    """Parent and child, and pose of the child in the parent: x y z qx qy qz qw."""
    edges = []
    for stamped in getattr(message, "transforms", [message]):
        if hasattr(stamped, "transform"):
            edge, pose = (stamped.header.frame_id, stamped.child_frame_id), stamped.transform
        else:
            edge, pose = (stamped.parent_frame_id, stamped.child_frame_id), stamped
        place = pose.translation
        try:
            numbers = np.array([place.x, place.y, place.z, *quaternion_of(pose.rotation)], float)
        except ValueError:  # some publishers leave the quaternion at zero
            continue
        if np.isfinite(numbers).all():
            edges.append((tuple(printable(str(name)) for name in edge), numbers))
    return edges


def is_read(schema: str) -> bool:
    """Whether messages of a type are of use, by its schema's name; one without a name may be."""
    return not schema or any(kind_of(schema) in kinds for kinds in (TRANSFORMS, *READERS.values()))


Read = Callable[[Message], Reading]
# How each type is read for each role, the best types first; None where it depends on the
# recording and on params (`topics`).
JOINTS: dict[str, Read | None] = dict.fromkeys(("JointState", "JointStates"))
TRANSFORMS = ("TFMessage", "FrameTransform", "FrameTransforms")
IMAGES: dict[str, Read | None] = dict.fromkeys(("Image", "RawImage", "CompressedImage"), read_image)
INFO: dict[str, Read | None] = dict.fromkeys(("CameraInfo", "CameraCalibration"), read_calibration)
READERS: dict[str, Mapping[str, Read | None]] = {
    "wrench": {
        "WrenchStamped": read_wrench,
        "FrankaRobotState": read_state_wrench,
        "FrankaState": read_state_wrench,
    },
    "pose": {
        "PoseStamped": read_pose,
        "PoseInFrame": read_pose,
        "PoseWithCovarianceStamped": read_pose,
        "FrankaRobotState": read_state_pose,
        "FrankaState": read_state_pose,
        **JOINTS,
        "Odometry": read_pose,
        "PosesInFrame": read_poses,
        **dict.fromkeys(TRANSFORMS),
    },
    "gripper": JOINTS,
    "color": IMAGES,
    "depth": IMAGES,
    "color_info": INFO,
    "depth_info": INFO,
}
