"""Topics of JSON messages, made in memory, of a hand whose motion is a formula."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from mcap.records import Schema
from scipy.spatial.transform import Rotation

from sling2sim2real.recording.files import Container
from sling2sim2real.recording.messages import Reading, Topic
from sling2sim2real.recording.topics import Choice, choose

COUNT, RATE = 200, 100.0
TIMES = np.arange(COUNT) / RATE
PLACES = np.stack([0.3 + 0.1 * np.sin(TIMES), 0.2 * TIMES, 0.4 - 0.1 * TIMES**2], axis=1)
TURNS = Rotation.from_rotvec(np.stack([0.3 * TIMES, np.sin(TIMES), 2 + 0 * TIMES], axis=1))
POSES = np.hstack([PLACES, TURNS.as_quat()])
FORCE = {"x": 1.0, "y": 2.0, "z": 3.0}


def head(k: int, frame: str = "base") -> dict:
    return {"header": {"stamp": {"sec": 5, "nanosec": round(1e9 * TIMES[k])}, "frame_id": frame}}


def channel(name: str, kind: str, messages: list[dict], rate: float = RATE) -> Topic:
    topic = Topic.of(name, Schema(1, b"{}", "jsonschema", kind), "json")
    for k, message in enumerate(messages):
        topic.add(5_000_000_000 + round(1e9 * k / rate), json.dumps(message).encode())
    return topic


def wrench(topic: str, rate: float = 1000.0, count: int = COUNT) -> Topic:
    messages = [{**head(k, "sensor"), "wrench": {"force": FORCE}} for k in range(count)]
    return channel(topic, "geometry_msgs/WrenchStamped", messages, rate)


def pose_fields(pose: np.ndarray) -> dict:
    position = dict(zip("xyz", pose[:3], strict=True))
    return {"position": position, "orientation": dict(zip("xyzw", pose[3:], strict=True))}


def pose(topic: str = "/arm/current_pose", rate: float = RATE) -> Topic:
    messages = [{**head(k), "pose": pose_fields(POSES[k])} for k in range(COUNT)]
    return channel(topic, "geometry_msgs/msg/PoseStamped", messages, rate)


def joints(topic: str, names: list[str], positions: np.ndarray) -> Topic:
    messages = [
        {**head(k, ""), "name": names, "position": list(positions[k])} for k in range(COUNT)
    ]
    return channel(topic, "sensor_msgs/msg/JointState", messages)


def picture(topic: str, encoding: str, frame: str, width: int = 4, height: int = 2) -> Topic:
    size = {"rgb8": 3, "bayer_rggb8": 1, "16UC1": 2, "mono8": 1}[encoding]
    fields = {"height": height, "width": width, "step": size * width, "encoding": encoding}
    messages = [
        {**head(k, frame), **fields, "data": [0] * (size * width * height)} for k in range(3)
    ]
    return channel(topic, "sensor_msgs/msg/Image", messages, 30)


def info(topic: str, frame: str, focal: float = 50.0, width: int = 4, height: int = 2) -> Topic:
    k = [focal, 0, 2, 0, focal, 1, 0, 0, 1]
    message = {"width": width, "height": height, "k": k, "d": [], "p": [], "distortion_model": ""}
    return channel(topic, "sensor_msgs/msg/CameraInfo", [{**head(0, frame), **message}] * 2, 30)


CAMERA = (
    picture("/cam/color/image", "rgb8", "color"),
    info("/cam/color/camera_info", "color"),
    picture("/cam/depth/image", "16UC1", "depth"),
    info("/cam/depth/camera_info", "depth", 40.0),
)


def chosen(params, *topics_: Topic, camera=CAMERA, topics=(), **setup: object):
    given = {**setup, "topics": params.setup.topics.model_copy(update=dict(topics))}
    file = Container(Path("f.mcap"), [*topics_, *camera])
    return choose(file, params.setup.model_copy(update=given))


def played(choice: Choice) -> tuple[str, np.ndarray]:
    """Frame, and what the reader makes of a topic."""
    samples = [sample for _, sample in choice.messages if isinstance(sample, Reading)]
    assert len(samples) == len(choice.messages)
    stamps = np.array([sample.stamp for sample in samples])
    np.testing.assert_array_equal(stamps, 5_000_000_000 + np.round(1e9 * TIMES))
    values = np.array([sample.value for sample in samples])
    return samples[0].frame, choice.convert(values) if choice.convert else values


def assert_poses(poses: np.ndarray, atol: float = 1e-9) -> None:
    np.testing.assert_allclose(poses[:, :3], POSES[:, :3], atol=atol)
    off = (Rotation.from_quat(poses[:, 3:]).inv() * TURNS).magnitude()
    assert off.max() < max(atol, 1e-7)
