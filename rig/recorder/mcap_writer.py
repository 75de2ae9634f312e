"""ROS 2 bags in MCAP without ROS: rosbags knows the messages, mcap the container."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore


class BagWriter:
    """Collects messages and writes them in the order in which they would have been received.

    Equal messages give equal bytes.
    """

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_HUMBLE)
        self._topics: dict[str, str] = {}
        self._messages: list[tuple[int, int, str, int, bytes]] = []

    def make(self, kind: str, *values: Any, **fields: Any) -> Any:
        """A message of the type `kind`, package/Type."""
        return self.store.types[kind.replace("/", "/msg/")](*values, **fields)

    def header(self, stamp: int, frame: str) -> Any:
        """std_msgs/Header at `stamp` [ns]."""
        time = self.make("builtin_interfaces/Time", *divmod(stamp, 1_000_000_000))
        return self.make("std_msgs/Header", time, frame)

    def vector(self, values: Iterable[float], kind: str = "Vector3") -> Any:
        """geometry_msgs/Vector3, or another type of numbers alone: Point, Quaternion."""
        return self.make(f"geometry_msgs/{kind}", *map(float, values))

    def add(self, topic: str, message: Any, stamp: int, received: int) -> None:
        """Keep one message; `stamp` and `received` in ns."""
        kind = message.__msgtype__
        if self._topics.setdefault(topic, kind) != kind:
            raise ValueError(f"{topic} carries {self._topics[topic]}, not {kind}")
        data = bytes(self.store.serialize_cdr(message, kind))
        self._messages.append((received, len(self._messages), topic, stamp, data))

    def write(self, path: Path) -> None:
        """Write the bag: profile ros2, zstd chunks."""
        with open(path, "wb") as stream:
            writer = Writer(stream, compression=CompressionType.ZSTD)
            writer.start(profile="ros2")
            schemas: dict[str, int] = {}
            channels: dict[str, int] = {}
            counts: dict[str, int] = {}
            for topic, kind in self._topics.items():
                if kind not in schemas:
                    text = self.store.generate_msgdef(kind, ros_version=2)[0].strip()
                    schemas[kind] = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schemas[kind])
            for received, _, topic, stamp, data in sorted(self._messages, key=lambda m: m[:2]):
                counts[topic] = counts.get(topic, 0) + 1
                writer.add_message(channels[topic], received, data, stamp, counts[topic])
            writer.finish()
