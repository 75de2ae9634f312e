"""What goes wrong in labs, done to a sound recording: each keeps the physics and changes one thing.

The classes are those of public reports of force sensors', arms' and cameras' drivers.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from validation.recordings.streams import FORCE, FRAMES, GRIPPER, IMAGE, INFO, POSE, Bag, Message

PULLING = 5.0  # s after the first force: the hand draws the band
HEAD = 12  # bytes before the PNG of a compressedDepth
LAST_OPEN = 0.08  # m between the fingers of an open Franka hand


@dataclass(frozen=True)
class Fault:
    """A way in which a recording is wrong.

    Attributes:
        family: Of the classes of public reports.
        unit: Of the sizes, from hardly visible to gross.
        checks: Those that name it (recording/checks.py).
        make: Does it to a recording.
    """

    family: str
    unit: str
    sizes: tuple[float, float, float]
    checks: tuple[str, ...]
    make: Callable[[Bag, float], None]


def _messages(bag: Bag, what: str) -> list[Message]:
    if what in ("camera", "robot"):
        return getattr(bag, what)
    return bag.of({"force": FORCE, "pose": POSE}[what])


def late(what: str, bag: Bag, ms: float) -> None:
    for message in _messages(bag, what):
        message.stamp += round(1e6 * ms)
        message.log += round(1e6 * ms)


def drifting(what: str, bag: Bag, ppm: float) -> None:
    start = bag.start
    for message in _messages(bag, what):
        message.stamp += round((message.stamp - start) * 1e-6 * ppm)


def stepping(what: str, bag: Bag, ms: float) -> None:
    """The clock is set while the hand pulls."""
    start = bag.start
    for message in _messages(bag, what):
        if message.stamp - start > PULLING * 1e9:
            message.stamp += round(1e6 * ms)


def frozen(bag: Bag, seconds: float) -> None:
    """The last picture before the release is sent again with new stamps."""
    begin = bag.release - 0.1
    for word in ("color", "depth"):
        pictures = bag.of(IMAGE, word)
        times, last = bag.seconds(pictures), pictures[0]
        for time, message in zip(times, pictures, strict=True):
            if begin <= time < begin + seconds:
                message.content.data = last.content.data
            else:
                last = message


def smeared(bag: Bag, share: float) -> None:
    """A filter over time holds so much of the depth picture before, as drivers offer."""
    before = None
    for message in bag.of(IMAGE, "depth"):
        now = _depth(message).astype(float)
        if before is not None:
            now = np.where((now > 0) & (before > 0), share * before + (1 - share) * now, now)
        _set_depth(message, before := now)


def turned(bag: Bag, degrees: float) -> None:
    """The sensor is mounted otherwise than /tf_static says, about a line across the pull."""
    pull = bag.force[_place(bag, bag.release - 0.1)] - bag.force[:200].mean(axis=0)
    axis = np.cross(pull, np.eye(3)[np.argmin(np.abs(pull))])
    turn = Rotation.from_rotvec(np.deg2rad(degrees) * axis / np.linalg.norm(axis))
    bag.force = turn.apply(bag.force)


def zero_drifts(bag: Bag, newtons: float) -> None:
    time, way = bag.seconds(bag.of(FORCE)), _pull(bag)
    bag.force = bag.force + np.outer(newtons * time / time[-1], way)


def zero_stays_off(bag: Bag, newtons: float) -> None:
    """After the load the sensor does not return to its zero."""
    after = bag.seconds(bag.of(FORCE)) > bag.release + 0.01
    bag.force = bag.force + np.outer(newtons * after, _pull(bag))


def zeroed(bag: Bag, second: float) -> None:
    """Somebody sets the sensor to zero while it is recorded."""
    after = bag.seconds(bag.of(FORCE)) > second
    level = bag.force[_place(bag, second - 0.1) : _place(bag, second)].mean(axis=0)
    bag.force = bag.force - np.outer(after, level)


def saturated(bag: Bag, share: float) -> None:
    zero = bag.force[:200].mean(axis=0)
    before = bag.seconds(bag.of(FORCE)) < bag.release
    most = share * np.abs(bag.force[before] - zero).max()
    bag.force = np.clip(bag.force - zero, -most, most) + zero


def filtered(bag: Bag, samples: float) -> None:
    """A mean over the samples before, as a sensor's own filter takes it."""
    count, zero = int(samples), bag.force[:200].mean(axis=0)
    bag.force = lfilter(np.full(count, 1 / count), 1, bag.force - zero, axis=0) + zero


def in_unit(bag: Bag, factor: float) -> None:
    bag.force = bag.force * factor


def in_bursts(bag: Bag, count: float) -> None:
    """So many samples are read at once, and stamped then, some microseconds apart."""
    messages, count = bag.of(FORCE), int(count)
    for begin in range(0, len(messages), count):
        block = messages[begin : begin + count]
        end = block[-1].stamp
        for place, message in enumerate(block):
            message.stamp = end + 8000 * place
            message.log = message.stamp + 100_000


def repeated(what: str, bag: Bag, count: float) -> None:
    """A slower topic's value is sent again with new stamps."""
    name = "wrench" if what == "force" else "pose"
    last = None
    for place, message in enumerate(_messages(bag, what)):
        last = getattr(message.content, name) if place % int(count) == 0 else last
        setattr(message.content, name, copy.deepcopy(last))


def depth_scaled(bag: Bag, factor: float) -> None:
    for message in bag.of(IMAGE, "depth"):
        _set_depth(message, _depth(message).astype(float) * factor)


def focal_off(bag: Bag, percent: float) -> None:
    for message in bag.of(INFO):
        for name, places in (("k", (0, 4)), ("p", (0, 5))):
            matrix = np.array(getattr(message.content, name))
            matrix[list(places)] *= 1 + percent / 100
            setattr(message.content, name, matrix)


def camera_moved(bag: Bag, mm: float) -> None:
    for pose in _optical(bag):
        pose.translation.z += 1e-3 * mm


def camera_turned(bag: Bag, degrees: float) -> None:
    for pose in _optical(bag):
        q = pose.rotation
        turn = Rotation.from_quat([q.x, q.y, q.z, q.w])
        turn = turn * Rotation.from_euler("y", degrees, degrees=True)
        q.x, q.y, q.z, q.w = map(float, turn.as_quat())


def another_arm(bag: Bag, noise: float) -> None:
    """It rests beside the one that pulls, and its topics come first by name."""
    rng = np.random.default_rng(1)
    for message in [*bag.of(FORCE), *bag.of(POSE)]:
        other = copy.deepcopy(message)
        other.topic, message.topic = f"/a_left{message.topic}", f"/b_right{message.topic}"
        if message.type.endswith(FORCE):
            force = other.content.wrench.force
            force.x, force.y, force.z = map(float, rng.normal(0, noise, 3))
        else:
            place = other.content.pose.position
            place.x, place.y, place.z = 0.35, 0.0, 0.4
        bag.messages.append(other)


def dead_force(bag: Bag, value: float) -> None:
    """Another topic of forces, always the same."""
    for message in bag.of(FORCE):
        other = copy.deepcopy(message)
        other.topic, force = "/a_sensor/wrench", other.content.wrench.force
        force.x, force.y, force.z = 0.0, 0.0, value
        bag.messages.append(other)


def opening_as(kind: str, bag: Bag, size: float) -> None:
    """The gripper tells an angle that grows as it closes, a percentage, or mirrored fingers."""
    for message in bag.of(GRIPPER):
        state = message.content
        opening = float(np.sum(state.position))
        if kind == "angle":
            state.name, state.position = ["finger_joint"], [size * (1 - opening / LAST_OPEN)]
        elif kind == "percent":
            state.name, state.position = ["gripper"], [size * opening / LAST_OPEN]
        else:
            state.name = ["left_finger_joint", "right_finger_joint"]
            state.position = [size * opening / 2, -size * opening / 2]
        state.position = np.array(state.position)
        state.velocity = state.effort = np.zeros(len(state.position))


def stale(bag: Bag, seconds: float) -> None:
    """The first pose is one of long ago."""
    first = copy.deepcopy(bag.of(POSE)[0])
    first.stamp += round(1e9 * seconds)
    first.log = min(message.log for message in bag.messages)
    bag.messages.insert(0, first)


def padded(bag: Bag, count: float) -> None:
    """JPEGs with zeros behind their end."""
    for message in bag.of(IMAGE, "color"):
        message.content.data = np.append(message.content.data, np.zeros(int(count), np.uint8))


def torn(bag: Bag, share: float) -> None:
    """So many colour pictures are no pictures."""
    rng = np.random.default_rng(2)
    for message in bag.of(IMAGE, "color"):
        if rng.random() < share:
            message.content.data = np.full(1000, 7, np.uint8)


def _place(bag: Bag, second: float) -> int:
    return int(np.searchsorted(bag.seconds(bag.of(FORCE)), second))


def _pull(bag: Bag) -> np.ndarray:
    """Direction of the force at the release, in the sensor's axes, shape (3,)."""
    pull = bag.force[_place(bag, bag.release - 0.1)] - bag.force[:200].mean(axis=0)
    return pull / np.linalg.norm(pull)


def _depth(message: Message) -> np.ndarray:
    packed = np.frombuffer(bytes(message.content.data)[HEAD:], np.uint8)
    picture = cv2.imdecode(packed, cv2.IMREAD_UNCHANGED)
    assert picture is not None
    return picture


def _set_depth(message: Message, values: np.ndarray) -> None:
    picture = np.clip(np.round(values), 0, 65535).astype(np.uint16)
    packed = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    head = np.frombuffer(bytes(message.content.data)[:HEAD], np.uint8)
    message.content.data = np.concatenate([head, packed.ravel()])


def _optical(bag: Bag):
    for message in bag.of(FRAMES):
        for transform in message.content.transforms:
            if "optical" in transform.child_frame_id:
                yield transform.transform


CLOCKS = "clock", "delay", "release_pictures"
SEEN = "coverage", "off_plane", "damaged", "extrinsics"
FORCES = "range", "filter", "zero", "max_force", "release"
HOLD, RATES = ("direction", "units"), ("gap", "stamps", "rate")
FINGERS = ("gripper",)
TIMES = CLOCKS + SEEN
POSE_REPEATED, FORCE_REPEATED = partial(repeated, "pose"), partial(repeated, "force")
FAULTS = {
    "camera_late": Fault("time", "ms", (5, 15, 60), TIMES, partial(late, "camera")),
    "force_late": Fault("time", "ms", (3, 10, 30), CLOCKS + FORCES, partial(late, "force")),
    "pose_late": Fault("time", "ms", (3, 10, 30), TIMES, partial(late, "pose")),
    "camera_drifts": Fault("time", "ppm", (500, 1500, 3000), TIMES, partial(drifting, "camera")),
    "force_drifts": Fault("time", "ppm", (500, 1500, 3000), TIMES, partial(drifting, "force")),
    "camera_steps": Fault("time", "ms", (5, 60, 300), TIMES, partial(stepping, "camera")),
    "robot_steps": Fault("time", "ms", (5, 60, 300), TIMES, partial(stepping, "robot")),
    "frozen": Fault("time", "s", (0.2, 0.4, 0.8), TIMES, frozen),
    "smeared": Fault("time", "", (0.4, 0.6, 0.8), TIMES, smeared),
    "turned": Fault("force", "degrees", (3, 10, 20), FORCES + HOLD + ("frames",), turned),
    "zero_drifts": Fault("force", "N", (0.4, 0.9, 2.0), FORCES, zero_drifts),
    "zero_stays_off": Fault("force", "N", (0.2, 0.6, 1.5), FORCES, zero_stays_off),
    "zeroed": Fault("force", "s", (0.4, 3.0, 5.0), FORCES, zeroed),
    "saturated": Fault("force", "", (0.95, 0.8, 0.6), FORCES, saturated),
    "filtered": Fault("force", "samples", (10, 30, 100), FORCES + RATES, filtered),
    "unit": Fault("force", "", (0.102, 0.2248, 1000), FORCES + HOLD, in_unit),
    "bursts": Fault("rates", "samples", (4, 16, 64), RATES + CLOCKS, in_bursts),
    "force_repeated": Fault("rates", "samples", (3, 10, 33), RATES, FORCE_REPEATED),
    "pose_repeated": Fault("rates", "samples", (10, 33, 100), RATES, POSE_REPEATED),
    "depth_scaled": Fault("camera", "", (1.005, 1.01, 1.03), SEEN, depth_scaled),
    "focal_off": Fault("camera", "%", (0.5, 1, 3), SEEN, focal_off),
    "camera_moved": Fault("camera", "mm", (3, 6, 15), SEEN, camera_moved),
    "camera_turned": Fault("camera", "degrees", (0.3, 0.8, 2), SEEN, camera_turned),
    "another_arm": Fault("roles", "N", (0.01, 0.05, 0.2), FINGERS, another_arm),
    "dead_force": Fault("roles", "N", (0, 0.1, 5), FINGERS, dead_force),
    "angle": Fault("conventions", "rad", (0.4, 0.8, 1.2), FINGERS, partial(opening_as, "angle")),
    "percent": Fault("conventions", "", (1, 85, 100), FINGERS, partial(opening_as, "percent")),
    "mirrored": Fault("conventions", "", (0.5, 1, 2), FINGERS, partial(opening_as, "mirrored")),
    "stale": Fault("conventions", "s", (-3600, -20, 3600), CLOCKS + RATES, stale),
    "padded": Fault("pictures", "bytes", (1, 16, 4096), SEEN, padded),
    "torn": Fault("pictures", "", (0.1, 0.5, 1.0), SEEN, torn),
    "depth_unit": Fault("causes", "", (0.1, 4, 10), SEEN, depth_scaled),
}  # fmt: skip
