"""MCAP file to `Recording`: which topic is which, their signals on header stamps, checked.

Everything comes sorted by header.stamp; log_time is when a message was received, which is late and
jitters, and serves only to notice a stamp of another clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from pipeline.errors import UserError
from pipeline.recording.container import Container, read_container, sha256
from pipeline.recording.decode import decoder
from pipeline.recording.frames import Transform, TransformTree
from pipeline.recording.images import Camera
from pipeline.recording.topics import OPTIONAL, Choice, choose

CLOCK_TOLERANCE = 0.5  # s between the clocks of two topics, by log_time - stamp


class Setup(Protocol):
    """What reading needs of params.setup."""

    topics: object


@dataclass(frozen=True)
class Stream:
    """One topic, sorted by stamp.

    Attributes:
        topic: Its name.
        frame: frame_id of its first message.
        stamp: header.stamp, ns, shape (S,), strictly increasing.
        values: One column a quantity, shape (S, C), or the messages of images, length S.
        delay: Median of log_time - stamp [s].
        lost: Messages that were damaged, not finite, or had a stamp twice.
    """

    topic: str
    frame: str
    stamp: np.ndarray
    values: np.ndarray | list
    delay: float
    lost: int

    def seconds(self, origin: int) -> np.ndarray:
        return (self.stamp - origin) * 1e-9

    @property
    def period(self) -> float:
        """Median time between messages [s]."""
        return float(np.median(np.diff(self.stamp))) * 1e-9

    @property
    def longest_gap(self) -> float:
        return float(np.max(np.diff(self.stamp))) * 1e-9

    @property
    def missing(self) -> int:
        """Messages that a constant rate would have had in the gaps."""
        gaps = np.diff(self.stamp) * 1e-9 / self.period
        return int(np.sum(np.maximum(np.round(gaps) - 1, 0)))


@dataclass(frozen=True)
class Recording:
    """What was read of one file.

    Attributes:
        wrench: Force [N] in `wrench.frame`, values (S, 3).
        pose: Position [m] and quaternion xyzw in `pose.frame`, values (S, 7).
        gripper: Sum of the finger positions [m], values (S, 1); None where not recorded.
        color, depth: Messages of images, decoded by `pipeline.recording.images`.
        color_camera, depth_camera: Their intrinsics.
        transforms: The static tree.
        losses: What was lost of the file, in words.
        sha256: Hash of the file.
    """

    path: Path
    wrench: Stream
    pose: Stream
    gripper: Stream | None
    color: Stream
    depth: Stream
    color_camera: Camera
    depth_camera: Camera
    transforms: TransformTree
    losses: list[str] = field(default_factory=list)
    sha256: str = ""

    @property
    def streams(self) -> dict[str, Stream]:
        roles = ("wrench", "pose", "gripper", "color", "depth")
        found = {role: getattr(self, role) for role in roles}
        return {role: stream for role, stream in found.items() if stream}


def read_recording(path: Path, setup: Setup) -> Recording:
    """Read and check a recording. Raises UserError with one line about what is missing or wrong."""
    return recording_of(read_container(Path(path)), setup)


def recording_of(container: Container, setup: Setup) -> Recording:
    """As `read_recording`, from a file that was read already."""
    path = container.path
    chosen = choose(container, setup.topics)
    streams = {
        role: _stream(path, chosen[role], read)
        for role, read in (
            ("wrench", _force),
            ("pose", _pose),
            ("gripper", _fingers),
            ("color", None),
            ("depth", None),
        )
        if role in chosen or role not in OPTIONAL
    }
    _same_clock(path, streams)
    return Recording(
        path=path,
        wrench=streams["wrench"],
        pose=streams["pose"],
        gripper=streams.get("gripper"),
        color=streams["color"],
        depth=streams["depth"],
        color_camera=_camera(path, chosen["color_info"]),
        depth_camera=_camera(path, chosen["depth_info"]),
        transforms=_transforms(container),
        losses=container.losses,
        sha256=sha256(path),
    )


def _force(message: object) -> tuple[float, ...]:
    force = message.wrench.force
    return force.x, force.y, force.z


def _pose(message: object) -> tuple[float, ...]:
    p, q = message.pose.position, message.pose.orientation
    if not np.linalg.norm([q.x, q.y, q.z, q.w]) > 1e-6:
        raise ValueError("the quaternion has no length")
    return p.x, p.y, p.z, q.x, q.y, q.z, q.w


def _fingers(message: object) -> tuple[float]:
    """Sum of the finger joints: two fingers that each move half the opening, or one value."""
    names = list(message.name)
    fingers = [i for i, name in enumerate(names) if "finger" in name.lower()]
    return (float(sum(message.position[i] for i in fingers or range(len(names)))),)


def _stream(path: Path, choice: Choice, read) -> Stream:
    """Decode one topic; `read` gives a message's numbers, None keeps the message."""
    stamps, logs, values, frame, lost = [], [], [], None, 0
    for log_time, payload in zip(choice.channel.log_times, choice.channel.payloads, strict=True):
        try:
            message = choice.decode(payload)
            value = message if read is None else read(message)
        except Exception:  # whatever damaged bytes do to the decoder
            lost += 1
            continue
        if read is not None and not np.all(np.isfinite(value)):
            lost += 1
            continue
        header = message.header
        frame = header.frame_id if frame is None else frame
        stamps.append(header.stamp.sec * 10**9 + header.stamp.nanosec)
        logs.append(log_time)
        values.append(value)
    topic = choice.channel.topic
    if len(stamps) < 2:
        raise UserError(f"{path}: topic {topic} has fewer than two readable messages")
    stamp = np.array(stamps, np.int64)
    if not stamp.any():
        raise UserError(f"{path}: topic {topic} has no header stamps, record with time stamps")
    order = np.argsort(stamp, kind="stable")
    order = order[np.diff(stamp[order], prepend=stamp.min() - 1) > 0]
    delay = np.median(np.array(logs, np.int64) - stamp) * 1e-9
    kept = [values[i] for i in order] if read is None else np.array(values, float)[order]
    lost += len(stamp) - len(order)
    return Stream(topic, frame, stamp[order], kept, float(delay), lost)


def _same_clock(path: Path, streams: dict[str, Stream]) -> None:
    delays = {stream.topic: stream.delay for stream in streams.values()}
    middle = float(np.median(list(delays.values())))
    worst = max(delays, key=lambda topic: abs(delays[topic] - middle))
    if abs(delays[worst] - middle) > CLOCK_TOLERANCE:
        raise UserError(
            f"{path}: the stamps of {worst} are {delays[worst] - middle:+.3f} s off the other"
            " topics' clock, record all topics with one clock"
        )


def _camera(path: Path, choice: Choice) -> Camera:
    info = choice.first()
    matrix = np.array(info.k if hasattr(info, "k") else info.K, float).reshape(3, 3)
    distortion = np.array(info.d if hasattr(info, "d") else info.D, float)
    known = info.distortion_model in ("", "plumb_bob", "rational_polynomial")
    if not known and distortion.any():
        raise UserError(
            f"{path}: {choice.channel.topic} has distortion model {info.distortion_model!r},"
            " publish plumb_bob or rational_polynomial"
        )
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or info.width < 1 or info.height < 1:
        raise UserError(f"{path}: {choice.channel.topic} is not calibrated (focal length 0)")
    if not distortion.any():
        distortion = np.zeros(0)
    return Camera(info.width, info.height, matrix, distortion, info.header.frame_id)


def _transforms(container: Container) -> TransformTree:
    tree = TransformTree()
    for channel in container.channels:
        if channel.topic.rsplit("/", 1)[-1] == "tf_static":
            decode = decoder(channel)
            for payload in channel.payloads:
                for one in _readable(decode, payload):
                    p, q = one.transform.translation, one.transform.rotation
                    pose = [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
                    if np.all(np.isfinite(pose)) and np.linalg.norm(pose[3:]) > 1e-6:
                        tree.add(one.header.frame_id, one.child_frame_id, Transform.of(pose))
    return tree


def _readable(decode, payload: bytes) -> list:
    try:
        return list(decode(payload).transforms)
    except Exception:  # a damaged message: a transform that is missed is asked for later
        return []
