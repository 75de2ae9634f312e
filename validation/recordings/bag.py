"""A small recording with known truth, written by another library than the one that reads it.

The hand, the band's shape, the force and the pictures are closed formulas; a disc of depth for each
point of the band's centre line is the whole renderer. CDR is written by mcap-ros2-support; the
pipeline reads it with rosbags.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace as Message
from typing import BinaryIO

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from mcap.records import Message as Recorded
from mcap.writer import Writer
from mcap_ros2._dynamic import serialize_dynamic
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from sling2sim2real.base.minimum_jerk import minimum_jerk

TYPES = {
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "pose": "geometry_msgs/msg/PoseStamped",
    "gripper": "sensor_msgs/msg/JointState",
    "color": "sensor_msgs/msg/CompressedImage",
    "depth": "sensor_msgs/msg/CompressedImage",
    "info": "sensor_msgs/msg/CameraInfo",
    "tf": "tf2_msgs/msg/TFMessage",
}
START = 1_700_000_000 * 10**9
TIPS = np.array([[-0.1375, 0, 0], [0.1375, 0, 0]])
FLOOR, REST, RADIUS = -0.52, 0.52, 0.005
CAMERA = Rotation.from_matrix(  # optical frame: z forward, y down, looking at the fork from a side
    np.stack([[-0.5, 0.866, 0], [0.4, 0.231, -0.887], [-0.768, -0.4434, -0.4619]]).T
)
EYE = np.array([0.75, 0.28, 0.42])
BASE = (Rotation.from_euler("z", 90, degrees=True), np.array([0.0, -0.72, -0.4]))
SENSOR = Rotation.from_euler("z", 30, degrees=True)
HAND = Rotation.from_matrix(np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0.0]]))  # z towards the fork


@dataclass(frozen=True)
class Lens:
    """The camera: pixels, focal length [pixels], pictures a second."""

    size: tuple[int, int] = (320, 240)
    focal: float = 250.0
    fps: int = 15


LENS = Lens()


@dataclass(frozen=True)
class Truth:
    """What is played: times in seconds since the first message."""

    grasp: float = 0.5
    lifted: float = 1.0
    drawn: float = 2.4
    release: float = 3.0004
    end: float = 4.2
    draw: float = 0.38
    stiffness: float = 40.0  # N/m of way from tip to hand to tip
    bias: tuple[float, float, float] = (2.0, -1.0, 4.0)
    noise: float = 0.04
    sign: float = 1.0
    band: tuple[int, int, int] = (30, 140, 240)  # BGR
    floor: int = 90
    arm: int = 230
    radius: float = RADIUS

    def hand(self, t: float) -> np.ndarray:
        low, lift = -0.195, minimum_jerk((t - self.grasp - 0.1) / (self.lifted - self.grasp - 0.1))
        pull = minimum_jerk((t - self.lifted) / (self.drawn - self.lifted))
        away = 0.06 * max(0.0, t - self.release)
        approach = 0.08 * (1 - minimum_jerk(t / max(self.grasp - 0.1, 0.05)))
        return np.array([0.0, -self.draw * pull - away - approach, low * (1 - lift)])

    def holds(self, t: float) -> bool:
        return self.grasp <= t < self.release

    def force(self, t: float) -> np.ndarray:
        """Force of the band on the gripper, frame O."""
        if not self.holds(t):
            return np.zeros(3)
        hand = self.hand(t)
        ways = TIPS - hand
        lengths = np.linalg.norm(ways, axis=1)
        tension = self.stiffness * max(lengths.sum() - REST, 0.0)
        return tension * (ways / lengths[:, None]).sum(axis=0)

    def center_line(self, t: float) -> np.ndarray:
        """Points of the band, shape (180, 3)."""
        s = np.linspace(0, 1, 90)[:, None]
        if self.holds(t):
            middle = self.hand(t)
        else:
            late = max(0.0, t - self.release) if t > self.release else 1.0
            swing = 0.1 * np.sin(12 * late) * np.exp(-late) if t > self.release else 0.0
            middle = np.array([0.0, swing, -0.195])
        parts = []
        for tip in TIPS:
            chord = np.linalg.norm(middle - tip)
            sag = np.sqrt(max(0.0, 3 / 8 * chord * (REST / 2 - chord)))
            parts.append(tip + (middle - tip) * s - sag * 4 * s * (1 - s) * [0, 0, 1])
        return np.vstack(parts)


class RosWriter:
    """Messages of ROS 2 in CDR; `finish` ends the file."""

    def __init__(self, file: BinaryIO, **options: object) -> None:
        self._writer, self._types = Writer(file, **options), get_typestore(Stores.ROS2_HUMBLE)
        self._writer.start("ros2")
        self._channels: dict[str, tuple[int, Callable[[object], bytes]]] = {}
        self.finish = self._writer.finish

    def write(self, topic: str, name: str, time: int, message: object) -> None:
        """Write a message of a type, received and sent at a time [ns]."""
        if topic not in self._channels:
            text = self._types.generate_msgdef(name, ros_version=2)[0]
            schema = self._writer.register_schema(name, "ros2msg", text.encode())
            number = self._writer.register_channel(topic, "cdr", schema)
            self._channels[topic] = number, serialize_dynamic(name, text)[name]
        number, encode = self._channels[topic]
        self._writer.add_message(number, time, encode(message), time)


def write_bag(
    path: Path,
    truth: Truth | None = None,
    *,
    change: Callable[[str, int, object], object] = lambda kind, t, message: message,
    cameras: bool = True,
    rate: int = 1000,
    pose_rate: int = 200,
    lens: Lens = LENS,
    receive: Callable[[str, float, float], float] = lambda kind, t, delay: t + delay,
    **options: object,
) -> Truth:
    """Write a recording.

    Args:
        path: The file.
        truth: What is played.
        change: (kind, stamp, message) to the message as it is written, None to drop it.
        cameras: Without them the pictures are there but black, which is faster.
        rate, pose_rate: Messages a second.
        lens: The camera.
        receive: (kind, time, usual delay) to log_time [s].
        options: For the MCAP writer.
    """
    truth, random = truth or Truth(), np.random.default_rng(1)
    to_sensor, to_base = (HAND * SENSOR).inv(), BASE[0].inv()
    turn = dict(zip("xyzw", (to_base * HAND).as_quat(), strict=True))
    with path.open("wb") as file:
        writer = RosWriter(file, **{"chunk_size": 200_000, **options})

        def write(kind: str, topic: str, t: float, delay: float, body: dict, frame: str) -> None:
            stamp = START + round(t * 1e9)
            header = {} if kind == "tf" else {"header": head(stamp, frame)}
            message = change(kind, stamp, Message(**header, **body))
            if message is not None:
                late = START + round(receive(kind, t, delay) * 1e9)
                writer.write(topic, TYPES[kind], late, message)

        write("tf", "/tf_static", 0.0, 0.0, {"transforms": _transforms()}, "")
        events = [(k / rate, "wrench") for k in range(int(truth.end * rate))]
        events += [(k / pose_rate, "pose") for k in range(int(truth.end * pose_rate))]
        events += [(k / 50, "gripper") for k in range(int(truth.end * 50))]
        events += [(0.004 + k / lens.fps, "frame") for k in range(int(truth.end * lens.fps))]
        for t, kind in sorted(events):
            if kind == "wrench":
                force = to_sensor.apply(truth.sign * truth.force(t)) + truth.bias
                force = force + random.normal(0, truth.noise, 3)
                wrench = Message(force=_vector(force), torque=_vector(np.zeros(3)))
                write(kind, "/ft/wrench", t, 0.0005, {"wrench": wrench}, "ft_sensor")
            elif kind == "pose":
                position = to_base.apply(truth.hand(t) - BASE[1])
                pose = Message(position=_vector(position), orientation=Message(**turn))
                write(kind, "/arm/current_pose", t, 0.0003, {"pose": pose}, "base")
            elif kind == "gripper":
                finger = 0.008 if truth.holds(t) or truth.holds(t - 0.03) else 0.04
                joints = {"name": ["finger_joint1", "finger_joint2"], "position": [finger] * 2}
                joints |= {"velocity": [], "effort": []}
                write(kind, "/gripper/joint_states", t, 0.0002, joints, "")
            else:
                color, depth = render(truth, t, lens) if cameras else _black(lens)
                _, jpeg = cv2.imencode(".jpg", color, [cv2.IMWRITE_JPEG_QUALITY, 92])
                _, png = cv2.imencode(".png", depth)
                info = _info(lens)
                write("info", "/camera/color/camera_info", t, 0.012, info, "optical")
                write("info", "/camera/depth/camera_info", t, 0.012, info, "optical")
                body = {"format": "bgr8; jpeg compressed bgr8", "data": jpeg.tobytes()}
                write("color", "/camera/color/compressed", t, 0.013, body, "optical")
                body = {"format": "16UC1; compressedDepth png", "data": bytes(12) + png.tobytes()}
                write("depth", "/camera/depth/compressedDepth", t, 0.016, body, "optical")
        writer.finish()
    return truth


def messages_of(path: Path) -> list[tuple[Schema, Channel, Recorded]]:
    """All messages of a file, as mcap's own reader has them."""
    with path.open("rb") as file:
        return list(make_reader(file).iter_messages())


def write_again(
    messages: Iterable[tuple[Schema, Channel, Recorded]], path: Path, **options: object
) -> None:
    """Write messages of `messages_of` to a file of their own; `options` are the MCAP writer's."""
    numbers: dict[str, int] = {}
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start("ros2")
        for schema, channel, message in messages:
            topic, encoding = channel.topic, channel.message_encoding
            if topic not in numbers:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                numbers[topic] = writer.register_channel(topic, encoding, kind)
            times = message.log_time, message.data, message.publish_time
            writer.add_message(numbers[topic], *times)
        writer.finish()


def edit(**edits: Callable[[int, object], object]) -> Callable[[str, int, object], object]:
    """A `change`: what is done to messages (stamp, message) of some kinds; False drops one."""

    def change(kind: str, stamp: int, message: object) -> object:
        dropped = kind in edits and edits[kind](stamp, message) is False
        return None if dropped else message

    return change


def head(stamp: int, frame: str = "ft_sensor") -> Message:
    """std_msgs/Header."""
    return Message(stamp=Message(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id=frame)


def blind_bag(folder: Path, truth: Truth | None = None, **options: object) -> Path:
    """A recording with black pictures, for what needs no band in them."""
    path = folder / "bag.mcap"
    write_bag(path, truth, **{"cameras": False, "rate": 500, **options})
    return path


def render(truth: Truth, t: float, lens: Lens = LENS) -> tuple[np.ndarray, np.ndarray]:
    """Colour (BGR) and depth (mm) of floor, fork, arm and band."""
    color, depth = (picture.copy() for picture in _still(lens, truth.floor))
    hand = truth.hand(t)
    palm = hand - np.linspace(0.07, 0.3, 15)[:, None] * [0, 1, 0]
    side = 0.5 * (0.016 if truth.holds(t) else 0.08) + 0.012
    fingers = hand - np.linspace(-0.005, 0.07, 16)[:, None] * [0, 1, 0]
    fingers = np.vstack([fingers + [side, 0, 0], fingers - [side, 0, 0]])
    for points, radius, paint in (
        (palm, 0.05, (truth.arm,) * 3),
        (fingers, 0.010, (truth.arm,) * 3),
        (truth.center_line(t), truth.radius, truth.band),
    ):
        _splat(color, depth, points, radius, paint, lens.focal)
    noise = np.random.default_rng(round(t * 1e4)).normal(0, 0.0008, depth.shape)
    millimetres = np.round(1000 * (depth + noise * depth**2)).astype(np.uint16)
    return color, np.where(depth > 2.5, 0, millimetres).astype(np.uint16)


@lru_cache
def _still(lens: Lens, shade: int) -> tuple[np.ndarray, np.ndarray]:
    """Colour and depth [m] of floor and fork."""
    width, height = lens.size
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack([u - width / 2, v - height / 2, np.full(u.shape, lens.focal)], -1) / lens.focal
    downwards = (rays @ CAMERA.as_matrix().T)[..., 2]
    with np.errstate(divide="ignore"):
        depth = np.where(downwards < -1e-3, (FLOOR - EYE[2]) / downwards, 3.0).clip(0, 3.0)
    color = np.full((height, width, 3), shade, np.uint8)
    color[(u // 16 + v // 16) % 2 == 0] -= 20
    posts = TIPS[:, None] - [[0.0, 0.0, 1.0]] * np.linspace(0.012, 0.5, 60)[:, None]
    _splat(color, depth, posts.reshape(-1, 3), 0.012, (150, 150, 155), lens.focal)
    return color, depth


def _splat(color, depth, points: np.ndarray, radius: float, paint: tuple, focal: float) -> None:
    """Spheres: nearest surface for each pixel, shaded from the middle to the rim."""
    height, width = depth.shape
    seen = (points - EYE) @ CAMERA.as_matrix()
    for x, y, z in seen[seen[:, 2] > 0.1]:
        size = focal * radius / z
        cu, cv = focal * x / z + width / 2, focal * y / z + height / 2
        rows = slice(max(0, int(cv - size)), min(height, max(0, int(cv + size) + 2)))
        columns = slice(max(0, int(cu - size)), min(width, max(0, int(cu + size) + 2)))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            continue
        v, u = np.mgrid[rows, columns]
        off = ((u - cu) ** 2 + (v - cv) ** 2) / size**2
        near = z - radius * np.sqrt(np.maximum(1 - off, 0))
        hit = (off < 1) & (near < depth[rows, columns])
        depth[rows, columns][hit] = near[hit]
        shade = (1 - 0.4 * off[hit])[:, None]
        color[rows, columns][hit] = (shade * paint).astype(np.uint8)


def _black(lens: Lens) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((*lens.size[::-1], 3), np.uint8), np.zeros(lens.size[::-1], np.uint16)


def _vector(v: np.ndarray) -> Message:
    return Message(x=float(v[0]), y=float(v[1]), z=float(v[2]))


def _transforms() -> list[Message]:
    inverse = BASE[0].inv()
    return [
        _transform("fork", "base", BASE[0], BASE[1]),
        _transform("base", "optical", inverse * CAMERA, inverse.apply(EYE - BASE[1])),
        _transform("hand_tcp", "ft_sensor", SENSOR, np.array([0, 0, -0.1])),
    ]


def _transform(parent: str, child: str, rotation: Rotation, place: np.ndarray) -> Message:
    q = Message(**dict(zip("xyzw", rotation.as_quat(), strict=True)))
    return Message(
        header=head(START, parent),
        child_frame_id=child,
        transform=Message(translation=_vector(place), rotation=q),
    )


def _info(lens: Lens) -> dict[str, object]:
    (width, height), focal = lens.size, lens.focal
    matrix = [focal, 0.0, width / 2, 0.0, focal, height / 2, 0.0, 0.0, 1.0]
    return {
        "width": width,
        "height": height,
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": matrix,
        "r": list(np.eye(3).ravel()),
        "p": [*matrix[:3], 0.0, *matrix[3:6], 0.0, *matrix[6:], 0.0],
        "binning_x": 0,
        "binning_y": 0,
        "roi": Message(x_offset=0, y_offset=0, height=0, width=0, do_rectify=False),
    }
