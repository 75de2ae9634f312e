"""A ROS 2 recording as messages that can be changed, and written again."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.typesys import Stores, get_typestore

from sling2sim2real.base.files import replacing

STORE = get_typestore(Stores.ROS2_HUMBLE)
FORCE, POSE, GRIPPER = "WrenchStamped", "PoseStamped", "JointState"
IMAGE, INFO, FRAMES = "CompressedImage", "CameraInfo", "TFMessage"


@dataclass
class Message:
    """One message, decoded; times in ns."""

    topic: str
    type: str
    log: int
    content: Any

    @property
    def stamp(self) -> int:
        at = self.content.header.stamp
        return at.sec * 10**9 + at.nanosec

    @stamp.setter
    def stamp(self, value: int) -> None:
        at = self.content.header.stamp
        at.sec, at.nanosec = int(value // 10**9), int(value % 10**9)


@dataclass
class Bag:
    """All messages of a file in which one arm pulls one band before one camera."""

    messages: list[Message] = field(default_factory=list)

    @classmethod
    def read(cls, path: Path) -> Bag:
        messages = []
        with path.open("rb") as file:
            for schema, channel, record in make_reader(file).iter_messages(log_time_order=False):
                assert schema is not None
                content = STORE.deserialize_cdr(record.data, schema.name)
                messages.append(Message(channel.topic, schema.name, record.log_time, content))
        return cls(messages)

    def write(self, path: Path) -> None:
        with replacing(path) as temporary, temporary.open("wb") as file:
            writer, channels = Writer(file), {}
            writer.start("ros2", "validation")
            for message in sorted(self.messages, key=lambda message: message.log):
                if (message.topic, message.type) not in channels:
                    definition = STORE.generate_msgdef(message.type)[0].encode()
                    schema = writer.register_schema(message.type, "ros2msg", definition)
                    channel = writer.register_channel(message.topic, "cdr", schema)
                    channels[message.topic, message.type] = channel
                data = bytes(STORE.serialize_cdr(message.content, message.type))
                writer.add_message(
                    channels[message.topic, message.type], message.log, data, message.log
                )
            writer.finish()

    def of(self, kind: str, word: str = "") -> list[Message]:
        """Messages of a type, on topics that hold a word, by stamp; FRAMES as they come."""
        matches = [m for m in self.messages if m.type.endswith(f"/{kind}") and word in m.topic]
        return matches if kind == FRAMES else sorted(matches, key=lambda message: message.stamp)

    @property
    def robot(self) -> list[Message]:
        return [*self.of(FORCE), *self.of(POSE), *self.of(GRIPPER)]

    @property
    def camera(self) -> list[Message]:
        return [*self.of(IMAGE), *self.of(INFO)]

    @property
    def start(self) -> int:
        """The first force's stamp [ns]."""
        return self.of(FORCE)[0].stamp

    def seconds(self, messages: list[Message]) -> np.ndarray:
        """Stamps since the first force [s], shape (S,)."""
        start = self.start
        return 1e-9 * np.array([message.stamp - start for message in messages])

    @property
    def force(self) -> np.ndarray:
        """Shape (S, 3) [N]."""
        summary = [message.content.wrench.force for message in self.of(FORCE)]
        return np.array([[force.x, force.y, force.z] for force in summary])

    @force.setter
    def force(self, values: np.ndarray) -> None:
        for message, value in zip(self.of(FORCE), values, strict=True):
            force = message.content.wrench.force
            force.x, force.y, force.z = map(float, value)

    @property
    def release(self) -> float:
        """Time at which the force falls fastest [s]."""
        size = np.linalg.norm(self.force - self.force[:200].mean(axis=0), axis=1)
        fall = size[:-20] - size[20:]
        return float(self.seconds(self.of(FORCE))[int(fall.argmax()) + 10])
