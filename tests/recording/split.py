"""A recording as the folder of a split bag, written by mcap's own writer."""

from __future__ import annotations

import json
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer


def split(file: Path, folder: Path, cuts: tuple[float, ...], stem: str = "my") -> list[Path]:
    """The parts of a recording that was split so many seconds after its start, by mcap's writer."""
    folder.mkdir(parents=True, exist_ok=True)
    with file.open("rb") as stream:
        messages = list(make_reader(stream).iter_messages())
    start, parts = messages[0][2].log_time, []
    edges = [-1.0, *cuts, 1e9]
    for number, (low, high) in enumerate(zip(edges, edges[1:], strict=False)):
        parts.append(folder / f"{stem}_{number}.mcap")
        with parts[-1].open("wb") as stream:
            writer, channels = Writer(stream), {}
            writer.start("ros2")
            for schema, channel, message in messages:
                assert schema
                if not low <= (message.log_time - start) * 1e-9 < high:
                    continue
                if channel.topic not in channels:
                    schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                    number_of = writer.register_channel(channel.topic, "cdr", schema_id)
                    channels[channel.topic] = number_of
                times = message.log_time, message.data, message.publish_time
                writer.add_message(channels[channel.topic], *times)
            writer.finish()
    return parts


def metadata(folder: Path, *names: str) -> None:
    """As rosbag2 writes it, but for what is not read."""
    fields = {"version": 5, "storage_identifier": "mcap", "relative_file_paths": list(names)}
    text = json.dumps({"rosbag2_bagfile_information": fields})  # JSON is YAML
    (folder / "metadata.yaml").write_text(text)
