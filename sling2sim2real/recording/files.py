"""Recordings on disk: their messages by topic, whole or damaged, and what was lost of them.

Read are MCAP files, ROS 2 bags in SQLite and ROS 1 bags, and the folder of a ROS 2 bag, whose parts
are one recording: `ros2 bag record -o my` makes my/ with my_0.mcap; where it splits the bag, with
my_1.mcap and so on. /tf_static is in the first part alone.

A file is read once, message by message: each is decoded as it comes, pictures' bytes go to a
temporary file, and topics of types that nobody reads are counted. What is wrong with a file is a
loss, which may cost messages, or a note, which costs none:

- An MCAP chunk whose checksum, size or records are wrong is dropped whole; the rest is used.
- An MCAP file without an end is read up to where it was cut, and one with bytes that are no record
  up to these. No index is needed. Where nothing has a checksum, damage may pass unnoticed.

https://mcap.dev/spec
"""

from __future__ import annotations

import hashlib
import re
import struct
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap import records as kinds
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from rosbags.interfaces import MessageDefinitionFormat

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.messages import NO_SCHEMA, Spool, Topic
from sling2sim2real.recording.words import counted, few

SUFFIXES = (".mcap", ".db3", ".bag")
GAP = 1.0  # s: a recorder that splits its bag pauses for less, people who record anew for more
NAMED = 5  # files, places or topics named in one line
LIMIT = 2**29  # bytes of one record
MAGIC, SQLITE, ROS1 = b"\x89MCAP0\r\n", b"SQLite format 3", b"#ROSBAG V2.0"
# What reading raises where bytes are no record, or a checksum does not hold.
DAMAGE = (
    McapError,
    struct.error,
    ValueError,
    MemoryError,
    OverflowError,
    RuntimeError,
    zstandard.ZstdError,
)
OTHERS = {  # by its first bytes: what it is, and how to mend it
    b"version https://git-lfs": "a Git LFS pointer, not the recording: `git lfs pull` fetches it",
    b"\x28\xb5\x2f\xfd": "packed by zstd: unpack it (`zstd -d`)",
    b"\x1f\x8b": "packed by gzip: unpack it (`gunzip`)",
    b"\x04\x22\x4d\x18": "packed by LZ4: unpack it (`lz4 -d`)",
    b"PK\x03\x04": "a ZIP archive: unpack it",
}


@dataclass
class Container:
    """All topics of a recording, and in words what was lost of it and what else to know."""

    path: Path
    topics: list[Topic]
    losses: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class _Topics:
    """Topics as they are found; of one name, type and encoding they are one."""

    def __init__(self) -> None:
        self.by_kind: dict[tuple, Topic] = {}
        self.spool = Spool()

    def of(self, name: str, schema: kinds.Schema, encoding: str) -> Topic:
        text = schema.data
        if "msg" in schema.encoding:  # merged files differ in their schemas' comments
            text = b" ".join(re.sub(rb"#[^\n]*", b"", text).split())
        kind = name, schema.name, schema.encoding, text, encoding
        if kind not in self.by_kind:
            self.by_kind[kind] = Topic.of(printable(name), schema, encoding, self.spool)
        return self.by_kind[kind]


def read_container(path: Path) -> Container:
    """Read every intact message, of all parts of a bag. Raises UserError: nothing is to be read."""
    path, topics = Path(path), _Topics()
    parts = parts_of(path)
    losses, notes = [], []
    if len(parts) > 1 and not path.is_dir():
        notes.append(f"all {len(parts)} parts of the bag were read, from {parts[0].name} on")
    for part in parts:
        name = f"{part.name}: " if len(parts) > 1 else ""
        try:
            with part.open("rb") as file:
                first = file.read(32)
                if first.startswith((SQLITE, ROS1)):
                    _read_bag(part, first.startswith(ROS1), topics)
                elif first.startswith(MAGIC):
                    losses += [f"{name}{loss}" for loss in _read_mcap(file, topics)]
                else:
                    what = (what for magic, what in OTHERS.items() if first.startswith(magic))
                    nothing = "not an MCAP file or bag (ros2 bag record -s mcap writes one)"
                    raise UserError(f"{part}: {next(what, nothing)}")
        except OSError as error:
            raise UserError(f"{part}: cannot be read ({error.strerror})") from error
    return Container(path, list(topics.by_kind.values()), losses, notes)


class _Whole:
    """A file that never returns less than was asked for, as mcap's reader believes."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file

    def read(self, size: int) -> bytes:
        data = self.file.read(size) if 0 <= size <= LIMIT else b""
        if len(data) < size:
            raise EndOfFile
        return data


def _read_mcap(file: BinaryIO, topics: _Topics) -> list[str]:
    """Read an MCAP file, record by record; what was lost of it, in words."""
    summary, schemas = None, {0: NO_SCHEMA}
    channels: dict[int, kinds.Channel] = {}
    with suppress(*DAMAGE, OSError):  # the end repeats what a damaged chunk may have said
        file.seek(0)
        if summary := make_reader(file, validate_crcs=True).get_summary():
            schemas |= summary.schemas
            channels |= summary.channels
    bound: dict[int, Topic] = {}  # a channel stays the first of its number
    losses, dropped, times, count, ended = [], [], [], 0, False
    file.seek(0)
    reader = StreamReader(
        _Whole(file),  # pyright: ignore[reportArgumentType]
        emit_chunks=True,
        validate_crcs=True,
        record_size_limit=LIMIT,
    )

    def seconds(time: int) -> str:
        return f"{(time - (times or [time])[0]) * 1e-9:.2f}"

    try:
        for record in _within_chunks(reader, dropped):
            if isinstance(record, kinds.Schema):
                schemas[record.id] = record
            elif isinstance(record, kinds.Channel):
                channels[record.id] = record
            elif isinstance(record, kinds.Message):
                count, number = count + 1, record.channel_id
                channel = channels.get(number)
                if number not in bound and channel and channel.schema_id in schemas:
                    schema = schemas[channel.schema_id]
                    bound[number] = topics.of(channel.topic, schema, channel.message_encoding)
                if number in bound:  # nothing says what others are, as where a damaged chunk did
                    bound[number].add(record.log_time, record.data)
                    times = [*times[:1], record.log_time]
            ended |= isinstance(record, kinds.DataEnd)
    except CRCValidationError:
        if not dropped:
            losses.append("the checksum of all messages together does not hold: some are damaged")
    except DAMAGE:
        if not ended:
            at, size = file.tell(), file.seek(0, 2)
            losses.append(
                f"cut off or damaged after {seconds((times or [0])[-1])} s, about byte {at} of"
                f" {size}: nothing behind it was read (`mcap recover` may get more)"
            )
    if dropped:
        where = [f"{seconds(a)} to {seconds(b)} s" for a, b in dropped]
        losses.append(f"{counted(len(where), 'damaged chunk')} dropped: {few(where, NAMED)}")
    if summary and summary.statistics and summary.statistics.message_count != count:
        said = summary.statistics.message_count
        losses.append(f"{count} of the {said} messages that the file counts were read")
    return losses


def _within_chunks(
    reader: StreamReader, dropped: list[tuple[int, int]]
) -> Iterator[kinds.McapRecord]:
    """All records, those of chunks too; log times of damaged chunks [ns] go to `dropped`."""
    for record in reader.records:
        if not isinstance(record, kinds.Chunk):
            yield record
            continue
        try:
            if record.uncompressed_size > LIMIT:
                raise ValueError("a chunk that is too large")
            inside = breakup_chunk(record, validate_crc=True)
        except DAMAGE:
            dropped.append((record.message_start_time, record.message_end_time))
        else:
            yield from inside


def _read_bag(part: Path, ros1: bool, topics: _Topics) -> None:
    """A ROS 1 bag, or a part of a ROS 2 bag in SQLite, rosbag2's default until Iron.

    Raises UserError where it is damaged.
    """
    from rosbags.rosbag1 import Reader as Ros1Reader  # others do not need what these import
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    bag = Ros1Reader(part) if ros1 else Sqlite3Reader(part)
    try:
        bag.open()
        for connection, time, data in bag.messages(bag.connections):
            idl = connection.msgdef.format == MessageDefinitionFormat.IDL
            kind, encoding = (
                ("ros1msg", "ros1") if ros1 else ("ros2idl" if idl else "ros2msg", "cdr")
            )
            text = str(connection.msgdef.data).encode()
            schema = kinds.Schema(connection.id, text, kind, connection.msgtype)
            topics.of(connection.topic, schema, encoding).add(time, bytes(data))
    except OSError:
        raise
    except Exception as error:  # the readers raise many kinds
        what = "a damaged ROS 1 bag" if ros1 else "no ROS 2 bag, or a damaged one"
        cure = "`rosbag reindex`" if ros1 else "`sqlite3 FILE .recover`"
        raise UserError(f"{part}: is {what} ({error}): {cure} may mend it") from error


def parts_of(path: Path) -> list[Path]:
    """The files that are one recording, in order.

    Of a folder those in it, by number. A file that is one of a split bag's parts stands for all.

    Raises:
        UserError: There is no recording, or a folder holds several.
    """
    path = Path(path)
    try:
        if path.is_file():
            stem, number = _numbered(path)
            alike = [file for file in _files(path.parent) if _numbered(file)[0] == stem]
            return alike if number >= 0 and _is_split(alike) else [path]
        files = _files(path)
        if len(files) == 1 or _is_split(files):
            return files
    except OSError as error:
        raise UserError(f"{path}: {str(error.strerror).lower()}") from error
    some = ", ".join(file.name for file in files[:NAMED])
    several = f"holds several recordings, or not all parts of one, name one file: {some}"
    nothing = "is a folder without a recording (ros2 bag record -s mcap writes one)"
    raise UserError(f"{path}: {several if some else nothing}")


def once(paths: Iterable[Path]) -> list[Path]:
    """List each recording once, where files are parts of one: the first that names it."""
    unique: list[Path] = []
    seen: set[Path] = set()
    for path in paths:
        parts = parts_of(path)
        if len(parts) == 1 or parts[0] not in seen:
            unique.append(path)
        seen.update(parts)
    return unique


def name_of(path: Path) -> str:
    """What a recording is called: a bag by its folder, or by what its parts have in common."""
    path = Path(path)
    if path.is_dir():
        return path.resolve().name
    return _numbered(path)[0] if len(parts_of(path)) > 1 else path.stem


def sha256(path: Path) -> str:
    """Hash of the file, also where it is a bag's only one; of several parts, of their hashes."""
    digests = []
    for part in parts_of(path):
        with part.open("rb") as file:
            digests.append(hashlib.file_digest(file, "sha256").hexdigest())
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _files(folder: Path) -> list[Path]:
    """Recordings by their names, in the order of their numbers."""
    files = [file for file in folder.iterdir() if file.suffix in SUFFIXES and file.is_file()]
    return sorted((file for file in files if file.stat().st_size), key=_numbered)


def _numbered(file: Path) -> tuple[str, int]:
    """The bag's name and the part's number of a file that is named like a part, otherwise -1."""
    match = re.fullmatch(r"(.*)_(\d{1,6})", file.stem)
    return (match[1], int(match[2])) if match else (file.stem, -1)


def _is_split(files: list[Path]) -> bool:
    """Whether these are the parts of one bag, each of which begins where the one before ends."""
    numbered = [_numbered(file) for file in files]
    if len(files) < 2 or numbered != [(numbered[0][0], k) for k in range(len(files))]:
        return False
    spans = [_span(file) for file in files]
    return all(
        not (before and after) or abs(after[0] - before[1]) < GAP * 1e9
        for before, after in zip(spans, spans[1:], strict=False)
    )


def _span(part: Path) -> tuple[int, int] | None:
    """Log times of the first and of the last message [ns]; None where the file's end says none."""
    with suppress(*DAMAGE, OSError), part.open("rb") as file:
        summary = make_reader(file).get_summary()
        if summary and (numbers := summary.statistics):
            return numbers.message_start_time, numbers.message_end_time
    return None
