"""The MCAP container: every intact message of a file, also of one that was cut off or damaged.

Chunks are read one after the other and checked (CRC); a damaged chunk is dropped and reported, and
a missing end costs only what it held. No index is needed.
"""

from __future__ import annotations

import hashlib
import struct
from dataclasses import dataclass, field
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Footer, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from pipeline.errors import UserError

MAGIC = b"\x89MCAP0\r\n"
CHUNK_LIMIT = 2**30  # a damaged size field must not ask for more memory than this


@dataclass
class Channel:
    """One topic with its raw messages, in the order of the file."""

    topic: str
    schema: Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)  # ns
    payloads: list[bytes] = field(default_factory=list)


@dataclass
class Container:
    """All channels of a file, and in words what was lost of it."""

    path: Path
    channels: list[Channel]
    losses: list[str]


def expect_file(path: Path) -> None:
    """Raises UserError where `path` is no file with something in it."""
    if path.is_dir():
        raise UserError(f"{path}: is a folder, name the .mcap file in it")
    if not path.exists():
        raise UserError(f"{path}: no such file")
    if path.is_file() and not path.stat().st_size:
        raise UserError(f"{path}: is empty, record it again")


def read_container(path: Path) -> Container:
    """Read every intact message. Raises UserError where there is nothing to read."""
    path = Path(path)
    expect_file(path)
    try:
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise UserError(f"{path}: not an MCAP file (ros2 bag record -s mcap writes one)")
            limit = path.stat().st_size
            reader = StreamReader(file, skip_magic=True, emit_chunks=True, record_size_limit=limit)
            return _collect(path, reader)
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error


def sha256(path: Path) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _collect(path: Path, reader: StreamReader) -> Container:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    damaged = 0
    complete = False

    def keep(record: McapRecord) -> None:
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, ChannelRecord) and record.schema_id in schemas:
            new = Channel(record.topic, schemas[record.schema_id], record.message_encoding)
            channels.setdefault(record.id, new)
        elif isinstance(record, Message) and record.channel_id in channels:
            channels[record.channel_id].log_times.append(record.log_time)
            channels[record.channel_id].payloads.append(record.data)

    records = iter(reader.records)
    while True:
        try:
            record = next(records)
        except StopIteration:
            break
        except (McapError, struct.error, ValueError):  # the end is missing, or a length is wrong
            break
        if isinstance(record, Chunk):
            try:
                if record.uncompressed_size > CHUNK_LIMIT:
                    raise ValueError("chunk too large")
                for inner in breakup_chunk(record, validate_crc=True):
                    keep(inner)
            except Exception:  # zstd, lz4 and struct all have errors of their own
                damaged += 1
        else:
            complete |= isinstance(record, Footer)
            keep(record)

    losses = [] if complete else ["the file has no end: it was cut off, or damaged near its end"]
    if damaged:
        losses.append(f"{damaged} damaged chunk{'s' * (damaged > 1)} dropped")
    return Container(path, [one for one in channels.values() if one.payloads], losses)
