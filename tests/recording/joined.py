"""Recordings in one file, one after the other, as a lab has them that pulls several times."""

from __future__ import annotations

import struct
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer

STAMP = struct.Struct("<iI")  # header.stamp, behind the four bytes that begin a CDR message


def joined(path: Path, recordings: list[Path], gap: float = 0.01) -> list[float]:
    """Write ROS 2 recordings into one file as if each had begun `gap` [s] after the one before.

    Every stamp and time of receipt of a recording is moved alike; /tf_static is the first one's.

    Returns:
        By how much each was moved [s].
    """
    moved, end = [], None
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        channels: dict[str, int] = {}
        for recording in recordings:
            with recording.open("rb") as file:
                messages = list(make_reader(file).iter_messages())
            first = min(message.log_time for _, _, message in messages)
            shift = 0 if end is None else end + round(gap * 1e9) - first
            for schema, channel, message in messages:
                topic, data = channel.topic, message.data
                if topic == "/tf_static" and moved:
                    continue
                if topic not in channels:
                    number = writer.register_schema(schema.name, schema.encoding, schema.data)
                    channels[topic] = writer.register_channel(topic, "cdr", number)
                if topic != "/tf_static":
                    seconds, nanoseconds = STAMP.unpack_from(data, 4)
                    stamp = divmod(seconds * 10**9 + nanoseconds + shift, 10**9)
                    data = data[:4] + STAMP.pack(*stamp) + data[4 + STAMP.size :]
                received = message.log_time + shift
                writer.add_message(channels[topic], received, data, received)
            moved.append(shift * 1e-9)
            end = max(message.log_time for _, _, message in messages) + shift
        writer.finish()
    return moved
