"""Messages: by their schema to attributes, and by their type to what the pipeline takes from them.

ROS 2, ROS 1, Foxglove and Franka schemas differ in the names of fields and in where the stamp is;
here they become `Reading`s. `TYPES` is the one table of types: what is not in it is not read.

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
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from tempfile import TemporaryFile
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import zstandard
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import printable
from sling2sim2real.recording.camera import Calibration, Camera

LONGEST = 2**25  # bytes of a message that was packed: a raw 4K picture has less
LATEST = 2**62  # ns; a stamp beyond it is damage
FRANKA_BASE = "franka_base"  # frame of Franka states whose header names none, as franka_ros writes
PACKED = b"\x28\xb5\x2f\xfd"  # of zstd; no header of CDR begins so
XCDR2 = range(0x06, 0x0C)  # second byte: OMG DDS-XTypes 1.3, table 60
PACKAGES = ("geometry_msgs", "nav_msgs", "sensor_msgs", "std_msgs", "tf2_msgs")

Message = Any  # it has the attributes that its schema says, and whoever reads it finds out
Decoder = Callable[[bytes], Message]
Edge = tuple[str, str]  # parent and child frame
NO_SCHEMA = Schema(id=0, data=b"", encoding="", name="")


class Spool:
    """A temporary file of pictures' bytes: memory holds none of them."""

    def __init__(self) -> None:
        self._file = TemporaryFile(buffering=0)  # noqa: SIM115 (it ends with the last picture)
        self._size = 0

    def put(self, data: np.ndarray) -> Callable[[], np.ndarray]:
        """Keep some bytes; what gives them back."""
        place, self._size = self._size, self._size + len(data)
        self._file.write(data.data)
        return partial(self._get, place, len(data))

    def _get(self, place: int, size: int) -> np.ndarray:
        return np.frombuffer(os.pread(self._file.fileno(), size, place), np.uint8)


class Unreadable(str):
    """Why a message cannot be read, in one line."""

    @classmethod
    def by(cls, error: Exception) -> Unreadable:
        return cls(str(error).partition("\n")[0] or type(error).__name__)


@dataclass
class Topic:
    """One topic with what its messages say, in the order of the file.

    Attributes:
        name: Of the topic.
        log_times: Of all its messages [ns].
        readings: By what they show (`TYPES`) a reading of each message, or why there is none.
        problem: Why no message can be read, "" where some may.
    """

    name: str
    schema: Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)
    readings: dict[str, list[Reading | Unreadable]] = field(default_factory=dict)
    problem: str = ""
    readers: dict[str, Read] = field(default_factory=dict)
    decode: Decoder | None = None
    spool: Spool | None = None

    @classmethod
    def of(cls, name: str, schema: Schema, encoding: str, spool: Spool | None = None) -> Topic:
        """One without messages; pictures stay in memory without a spool."""
        topic = cls(name, replace(schema, name=printable(schema.name)), encoding, spool=spool)
        topic.readers = TYPES.get(topic.kind, {})
        topic.readings = {what: [] for what in topic.readers}
        if topic.readers:
            try:
                topic.decode = decoder(schema, encoding)
            except Exception as error:  # the parsers raise many kinds
                topic.problem = f"topic {name}: {Unreadable.by(error)}"
        return topic

    @property
    def kind(self) -> str:
        """The type's own name: geometry_msgs/msg/PoseStamped, a.b.PoseStamped -> PoseStamped."""
        kind = re.split(r"[/.:]+", self.schema.name)[-1].removesuffix("_")  # which DDS adds
        return "WrenchStamped" if kind.endswith("WrenchStamped") else kind

    def add(self, log_time: int, payload: bytes) -> None:
        """Read the next message."""
        self.log_times.append(log_time)
        if self.decode is None:
            return
        message = _tried(self.decode, payload)
        for what, read in self.readers.items():
            reading = message if isinstance(message, Unreadable) else _tried(read, message)
            if self.spool and isinstance(reading, Reading) and isinstance(reading.value, Picture):
                stored = replace(reading.value, content=self.spool.put(reading.value.data))
                reading = reading._replace(value=stored)
            self.readings[what].append(reading)


def _tried(make: Callable[[Any], Any], given: Any) -> Any:
    """What is made, or why it cannot be: damaged bytes make the libraries raise anything."""
    try:
        return make(given)
    except OSError:
        raise
    except Exception as error:
        return Unreadable.by(error)


def decoder(schema: Schema, encoding: str) -> Decoder:
    """A function from payload to a message with attributes; both raise anything."""
    make = DECODERS.get((schema.encoding, encoding))
    if encoding == "cdr" and _says_nothing(schema):
        make = _by_name
    if make is None:
        supported = ", ".join(f"{a} with {b}" for a, b in DECODERS)
        what = f"schema {schema.encoding!r}" if schema.encoding else "no schema"
        raise ValueError(
            f"{what} with messages {encoding!r} cannot be read, record one of: {supported}"
        )
    read = make(schema)
    return (lambda payload: read(_plain(payload))) if encoding == "cdr" else read


def _says_nothing(schema: Schema) -> bool:
    """Whether a standard type of ROS 2 is read by its name: its schema says no more, or in IDL."""
    name = _standard_name(schema.name)
    named = not schema.data.strip() or schema.data.strip() == schema.name.encode()
    says = schema.encoding == "ros2msg" and not named
    known = name.startswith(PACKAGES) and name in _store().fielddefs
    return known and not says and schema.encoding in ("", "omgidl", "ros2idl", "ros2msg")


def _standard_name(schema: str) -> str:
    """a::msg::dds_::B_, as DDS has it, and a/B to a/msg/B."""
    parts = re.split("::|/", schema)
    package, kind = parts[0], parts[-1]
    return f"{package}/msg/{kind.removesuffix('_') if '::' in schema else kind}"


def _plain(payload: bytes) -> bytes:
    """Return a message's CDR, unpacked where zstd packed it. Raises ValueError of XCDR2."""
    if payload[:4] == PACKED:  # ros2 bag record --compression-mode message
        with zstandard.ZstdDecompressor().stream_reader(payload) as stream:
            payload = stream.read(LONGEST)
    if len(payload) > 1 and not payload[0] and payload[1] in XCDR2:
        raise ValueError(
            "in XCDR2, record with a middleware that writes XCDR1, the default of ROS 2"
        )
    return payload


@lru_cache(1)
def _store() -> Typestore:
    return get_typestore(Stores.ROS2_HUMBLE)


def _by_name(schema: Schema) -> Decoder:
    return partial(_store().deserialize_cdr, typename=_standard_name(schema.name))


def _ros(schema: Schema) -> Decoder:
    """Decoder by types of this schema alone, because recordings may mix versions of a type."""
    text = schema.data.decode()
    name = _standard_name(schema.name)
    store = get_typestore(Stores.EMPTY)
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
    ("ros1msg", "ros1"): _ros,
    ("protobuf", "protobuf"): _protobuf,
    ("jsonschema", "json"): _json,
}


@dataclass(frozen=True)
class Picture:
    """What all image messages have in common.

    Attributes:
        encoding: Of raw pixels (rgb8, 16UC1, ...), "" where `data` is packed.
        format: Of packed data ("jpeg", "16UC1; compressedDepth png", ...), "" where it is raw.
        content: uint8, shape (bytes,), or what gives it.
        height, width: Pixels; 0 where packed, as are `step` and `is_bigendian`.
        step: Bytes a row, with its padding.
        stamp: Of its header, as it was recorded [ns].
    """

    encoding: str
    format: str
    content: np.ndarray | Callable[[], np.ndarray]
    height: int = 0
    width: int = 0
    step: int = 0
    is_bigendian: bool = False
    stamp: int = 0

    @property
    def data(self) -> np.ndarray:
        """The bytes, uint8."""
        return self.content() if callable(self.content) else self.content


class Reading(NamedTuple):
    """What a message says.

    Attributes:
        stamp: Of its header [ns]; None where the type has none.
        frame: frame_id, "" where there is none.
        value: wrench fx fy fz [N]; pose x y z [m] qx qy qz qw; positions of joints [rad, m], by
            name; a Picture; a Calibration; transforms, a pose for each (parent, child).
    """

    stamp: int | None
    frame: str
    value: Any


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


def _reading(message: Message, value: Any) -> Reading:
    return Reading(stamp_of(message), frame_of(message), value)


def read_wrench(message: Message) -> Reading:
    return _reading(message, _vector(getattr(message, "wrench", message).force))


def read_pose(message: Message) -> Reading:
    """PoseStamped and PoseInFrame; of PosesInFrame one of one pose, otherwise ValueError."""
    if hasattr(message, "poses"):
        (pose,) = message.poses
    else:
        pose = getattr(message.pose, "pose", message.pose)  # PoseWithCovariance
    return _reading(message, _pose(pose.position, pose.orientation))


def read_state_pose(message: Message) -> Reading:
    """O_T_EE: a PoseStamped in FrankaRobotState, a column-major 4 x 4 in FrankaState."""
    pose = first_of(message, "o_t_ee", "O_T_EE")
    if hasattr(pose, "pose"):
        frame = frame_of(pose) or frame_of(message) or FRANKA_BASE
        value = _pose(pose.pose.position, pose.pose.orientation)
        return Reading(stamp_of(message), frame, value)
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


def read_joints(message: Message) -> Reading:
    """JointState and foxglove.JointStates."""
    if hasattr(message, "joints"):
        joints = {str(joint.name): float(joint.position) for joint in message.joints}
    else:
        names, positions = map(str, message.name), map(float, message.position)
        joints = dict(zip(names, positions, strict=True))
    return _reading(message, joints)


def read_image(message: Message) -> Reading:
    """Image and foxglove.RawImage, CompressedImage and foxglove.CompressedImage."""
    data, stamp = _bytes(message.data), stamp_of(message) or 0
    if hasattr(message, "format"):
        packed = Picture("", str(message.format) or "unnamed", data, stamp=stamp)
        return _reading(message, packed)
    size = (int(message.height), int(message.width), int(message.step))
    swapped = bool(getattr(message, "is_bigendian", False))
    return _reading(message, Picture(str(message.encoding), "", data, *size, swapped, stamp))


def read_calibration(message: Message) -> Reading:
    """CameraInfo of ROS 2 (k, d, p) and ROS 1, foxglove.CameraCalibration (K, D, P)."""
    matrix = np.array(first_of(message, "k", "K"), float).reshape(3, 3)
    projection = np.array(first_of(message, "p", "P"), float)
    rectified = projection.reshape(3, 4)[:, :3] if projection.size == 12 else np.zeros((3, 3))
    distortion = np.array(first_of(message, "d", "D"), float).ravel()
    frame = frame_of(message)
    camera = Camera(int(message.width), int(message.height), matrix, distortion, frame)
    value = Calibration(camera, str(message.distortion_model), rectified)
    return _reading(message, value)


def read_transforms(message: Message) -> Reading:
    """TFMessage, FrameTransform and FrameTransforms."""
    some = getattr(message, "transforms", [message])
    edges: dict[Edge, np.ndarray] = {}
    for stamped in some:
        if hasattr(stamped, "transform"):
            parent, pose = stamped.header.frame_id, stamped.transform
        else:
            parent, pose = stamped.parent_frame_id, stamped
        try:
            numbers = np.array(_pose(pose.translation, pose.rotation))
        except ValueError:  # some publishers leave the quaternion at zero
            continue
        if np.isfinite(numbers).all():
            edges[printable(str(parent)), printable(str(stamped.child_frame_id))] = numbers
    return Reading(stamp_of(some[0]) if len(some) else None, "", edges)


def _pose(place: Message, turn: Message) -> tuple[float, ...]:
    """x y z qx qy qz qw. Raises ValueError where the quaternion has no length."""
    quaternion = tuple(float(getattr(turn, axis)) for axis in "xyzw")
    if not sum(x * x for x in quaternion) > 1e-12:
        raise ValueError("the quaternion has no length")
    return *_vector(place), *quaternion


def _vector(vector: Message) -> tuple[float, float, float]:
    return float(vector.x), float(vector.y), float(vector.z)


def _bytes(data: Message) -> np.ndarray:
    """Bytes, base64 as JSON has it, or a list of numbers, to uint8."""
    if isinstance(data, str):
        data = base64.b64decode(data, validate=True)
    if isinstance(data, bytes | bytearray | memoryview):
        return np.frombuffer(data, np.uint8)
    return np.asarray(data, np.uint8)


Read = Callable[[Message], Reading]
# What each type shows, and how it is read; the best types first.
TYPES: dict[str, dict[str, Read]] = {
    "WrenchStamped": {"wrench": read_wrench},
    "PoseStamped": {"pose": read_pose},
    "PoseInFrame": {"pose": read_pose},
    "PoseWithCovarianceStamped": {"pose": read_pose},
    "FrankaRobotState": {"pose": read_state_pose, "wrench": read_state_wrench},
    "FrankaState": {"pose": read_state_pose, "wrench": read_state_wrench},
    "JointState": {"joints": read_joints},
    "JointStates": {"joints": read_joints},
    "Odometry": {"pose": read_pose},
    "PosesInFrame": {"pose": read_pose},
    "TFMessage": {"transforms": read_transforms},
    "FrameTransform": {"transforms": read_transforms},
    "FrameTransforms": {"transforms": read_transforms},
    "Image": {"picture": read_image},
    "RawImage": {"picture": read_image},
    "CompressedImage": {"picture": read_image},
    "CameraInfo": {"info": read_calibration},
    "CameraCalibration": {"info": read_calibration},
}
