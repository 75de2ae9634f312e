"""Recordings on disk: their messages by topic, whole or damaged, and what was lost of them.

Read are MCAP files, also packed as a whole, ROS 2 bags in SQLite and ROS 1 bags, and the folder of
a ROS 2 bag, whose parts are one recording: `ros2 bag record -o my` makes my/ with metadata.yaml and
my_0.mcap; where it splits the bag, with my_1.mcap and so on. /tf_static is in the first part alone.

What is wrong with a file is either a loss, which may cost messages, or a note, which costs none:

- A chunk whose checksum, size or records are wrong is dropped whole; the rest is used.
- A file without an end is read up to where it was cut, and one with bytes that are no record up to
  these. No index is needed, and a damaged one costs nothing.
- Where nothing has a checksum, a note says that damage would not be noticed.

https://mcap.dev/spec
"""

from __future__ import annotations

import gzip
import hashlib
import re
import sqlite3
import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import lru_cache
from os import SEEK_END
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, BinaryIO

import lz4.frame
import numpy as np
import zstandard
from mcap import records as kinds
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from ruamel.yaml import YAML, YAMLError

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.messages import NO_SCHEMA, Channel, Payloads, Spool, is_read
from sling2sim2real.recording.words import counted, few

METADATA, SUFFIXES = "metadata.yaml", (".mcap", ".db3", ".bag")
PACKED_NAME = re.compile(r"\.(zstd?|gz|lz4)$")  # behind it, where the whole file is packed
NUMBERED = re.compile(r"(.*)_(\d{1,6})")
GAP = 1.0  # s: a recorder that splits its bag pauses for less, people who record anew for more
NAMED = 5  # files, places or topics named in one line
LONGEST = 86_400 * 10**9  # ns that a recording lasts
LIMIT = 2**29  # bytes of one record
BLOCK = 2**20
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
PACKED: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x28\xb5\x2f\xfd": lambda file: zstandard.ZstdDecompressor().stream_reader(
        file, read_across_frames=True, closefd=False
    ),
    b"\x1f\x8b": lambda file: gzip.GzipFile(fileobj=file),
    b"\x04\x22\x4d\x18": lambda file: lz4.frame.LZ4FrameFile(file),
}
OTHERS = {  # what it is, and how to mend it
    b"version https://git-lfs": "a Git LFS pointer, not the recording: `git lfs pull` fetches it",
    b"PK\x03\x04": "a ZIP archive: unpack it",
    b"\xfd7zXZ": "packed by xz: unpack it",
    b"BZh": "packed by bzip2: unpack it",
    b"7z\xbc\xaf": "packed by 7-Zip: unpack it",
}


@dataclass
class Container:
    """All channels of a recording, and in words what was lost of it and what else to know."""

    path: Path
    channels: list[Channel]
    losses: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def read_container(path: Path) -> Container:
    """Read every intact message, of all parts of a bag. Raises UserError: nothing is to be read."""
    path, spool = Path(path), Spool()
    parts = parts_of(path)
    whole = Container(path, [], missing_parts(path))
    if len(parts) > 1 and not path.is_dir():
        whole.notes.append(f"all {len(parts)} parts of the bag were read, from {parts[0].name} on")
    for part in parts:
        try:
            read = _read(part, spool)
        except OSError as error:
            raise UserError(f"{part}: cannot be read ({error.strerror})") from error
        name = f"{part.name}: " if len(parts) > 1 else ""
        whole.channels += read.channels
        whole.losses += [f"{name}{loss}" for loss in read.losses]
        whole.notes += [note for note in read.notes if note not in whole.notes]
    return replace(whole, channels=_merged(whole.channels))


def _read(part: Path, spool: Spool) -> Container:
    with part.open("rb") as file:
        first = file.read(len(SQLITE))
    if first.startswith(SQLITE):
        return _read_sqlite(part, spool)
    if first.startswith(ROS1):
        return _read_ros1(part, spool)
    with opened(part) as file:
        return _Mcap(spool).read(part, file)


def _merged(channels: Iterable[Channel]) -> list[Channel]:
    """Channels of one topic, type and encoding as one, whatever their schemas' comments say."""
    by_kind: dict[tuple, Channel] = {}
    for channel in channels:
        schema = channel.schema
        text = schema.data
        if "msg" in schema.encoding:
            text = b" ".join(re.sub(rb"#[^\n]*", b"", text).split())
        kind = channel.topic, schema.name, schema.encoding, text, channel.encoding
        if kind in by_kind:
            by_kind[kind].log_times.extend(channel.log_times)
            by_kind[kind].payloads.extend(channel.payloads)
        else:
            by_kind[kind] = channel
    return list(by_kind.values())


class _Whole:
    """A file that never returns less than was asked for, as mcap's reader believes."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file

    def read(self, size: int) -> bytes:
        data = self.file.read(size) if 0 <= size <= LIMIT else b""
        if len(data) < size:
            raise EndOfFile
        return data


class _Mcap:
    """Reads one MCAP file, record by record, and keeps what was in the way.

    Attributes:
        checked: Whether anything has a checksum.
        dropped: First and last log times of damaged chunks [ns].
        counted: Messages that the file's end speaks of; None where it does not.
        ended: Whether all messages were read.
    """

    def __init__(self, spool: Spool) -> None:
        self.spool = spool
        self.schemas: dict[int, kinds.Schema] = {}
        self.definitions: dict[int, kinds.Channel] = {}
        self.channels: dict[int, Channel] = {}  # by number, not yet named
        self.dropped: list[tuple[int, int]] = []
        self.counted: int | None = None
        self.checked = self.ended = False

    def read(self, path: Path, file: BinaryIO) -> Container:
        """All of the file, or up to where it cannot be read."""
        stopped, losses, notes = None, [], []
        whole: BinaryIO = _Whole(file)  # pyright: ignore[reportAssignmentType]
        try:
            for record in StreamReader(
                whole, emit_chunks=True, validate_crcs=True, record_size_limit=LIMIT
            ).records:
                self._take(record)
        except CRCValidationError:  # over all messages together
            self.checked = self.ended = True
            if not self.dropped:
                losses.append(
                    "the checksum of all messages together does not hold: what is damaged is not"
                    " known"
                )
        except DAMAGE:
            stopped = file.tell()
        channels, orphans = self._named()
        if stopped is not None and not self.ended:
            losses.insert(0, self._cut(file, stopped))
        if self.dropped:
            where = [f"{self._seconds(a)} to {self._seconds(b)} s" for a, b in self.dropped]
            count = counted(len(where), "damaged chunk")
            losses.append(f"{count} dropped: {few(where, NAMED)}")
        read = sum(len(channel.log_times) for channel in self.channels.values())
        if self.counted not in (None, read):
            losses.append(f"messages read of those that the file counts: {read} of {self.counted}")
        if not self.checked:
            notes.append("no checksums in the file: damage to its messages would not be noticed")
        if stopped is not None and self.ended:
            notes.append("the summary at the file's end is damaged: its counts were not compared")
        return Container(path, channels, [*losses, *orphans], notes)

    def _take(self, record: kinds.McapRecord) -> None:
        if isinstance(record, kinds.Chunk):
            self.checked |= record.uncompressed_crc != 0
            try:
                if record.uncompressed_size > LIMIT:
                    raise ValueError("a chunk that is too large")
                inside = breakup_chunk(record, validate_crc=True)
            except DAMAGE:
                self.dropped.append((record.message_start_time, record.message_end_time))
                return
            for part in inside:
                self._take(part)
        elif isinstance(record, kinds.Message):
            number = record.channel_id
            definition = self.definitions.get(number)
            schema = self.schemas.get(definition.schema_id) if definition else None
            if number not in self.channels:
                self.channels[number] = Channel("", NO_SCHEMA, "", [], Payloads(self.spool))
            self.channels[number].log_times.append(record.log_time)
            unread = schema is not None and not is_read(schema.name)
            self.channels[number].payloads.append(b"" if unread else record.data)
        elif isinstance(record, kinds.Schema):  # the first of its number counts
            self.schemas.setdefault(record.id, replace(record, name=printable(record.name)))
        elif isinstance(record, kinds.Channel):
            self.definitions.setdefault(record.id, replace(record, topic=printable(record.topic)))
        elif isinstance(record, kinds.Statistics):
            self.counted = record.message_count
        elif isinstance(record, kinds.DataEnd):
            self.checked |= record.data_section_crc != 0
            self.ended = True

    def _named(self) -> tuple[list[Channel], list[str]]:
        """Channels with their topics, and in words what could not be joined."""
        named, losses = [], []
        for number, channel in self.channels.items():
            definition, count = self.definitions.get(number), counted(len(channel.log_times))
            if definition is None:
                losses.append(f"{count} of channel {number} dropped: no record says what it is")
                continue
            schema = self.schemas.get(definition.schema_id)
            if schema is None and definition.schema_id:
                losses.append(f"{count} of {definition.topic} dropped: its schema is missing")
                continue
            channel.topic, channel.encoding = definition.topic, definition.message_encoding
            channel.schema = schema or NO_SCHEMA
            named.append(channel)
        return named, losses

    def _cut(self, file: BinaryIO, stopped: int) -> str:
        """Where the file cannot be read, of size bytes."""
        last = self._seconds(max(self._log_times(), default=0.0))
        size = file.seek(0, SEEK_END)
        file.seek(max(0, size - len(MAGIC)))
        if file.read() != MAGIC:
            return f"the file has no end: cut off after {last} s"
        return (
            f"cannot be read from about byte {stopped} of {size} on, after {last} s"
            " (`mcap recover` may get more of it)"
        )

    def _seconds(self, log_time: float) -> str:
        """Since the first message."""
        return f"{(log_time - min(self._log_times(), default=log_time)) * 1e-9:.2f}"

    def _log_times(self) -> np.ndarray:
        """log_times [ns] without those that are damage."""
        times = np.concatenate([np.zeros(0), *(c.log_times for c in self.channels.values())])
        return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times


def _read_sqlite(path: Path, spool: Spool) -> Container:
    """A part of a ROS 2 bag in SQLite, rosbag2's default until Iron; without an index or metadata.

    Raises UserError where it is no such bag.
    """
    try:
        with sqlite3.connect(f"file:{path}?mode=ro&immutable=1", uri=True) as base:
            texts: dict[str, tuple[str, str]] = {}
            with suppress(sqlite3.Error):  # Humble's bags have no definitions
                rows = "topic_type, encoding, encoded_message_definition FROM message_definitions"
                texts = {name: (kind, text) for name, kind, text in base.execute(f"SELECT {rows}")}
            channels: dict[int, Channel] = {}
            for number, topic, name, encoding in base.execute(
                "SELECT id, name, type, serialization_format FROM topics"
            ):
                kind, text = texts.get(name, ("ros2msg", ""))
                schema = kinds.Schema(number, text.encode(), kind, printable(name))
                topic = printable(topic)
                channels[number] = Channel(topic, schema, encoding, [], Payloads(spool))
            losses = []
            try:
                rows = base.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
                for number, time, data in rows:
                    channel = channels[number]
                    channel.log_times.append(time)
                    channel.payloads.append(bytes(data) if is_read(channel.schema.name) else b"")
            except (sqlite3.Error, KeyError) as error:
                losses.append(f"the rest of the file cannot be read ({error})")
    except sqlite3.Error as error:
        raise UserError(f"{path}: is no ROS 2 bag, or a damaged one ({error})") from error
    return Container(path, list(channels.values()), losses)


def _read_ros1(path: Path, spool: Spool) -> Container:
    """A ROS 1 bag. Raises UserError where it is damaged: its index is needed."""
    from rosbags.rosbag1 import Reader, ReaderError

    channels: dict[int, Channel] = {}
    try:
        with Reader(path) as bag:
            for connection, time, data in bag.messages():
                if connection.id not in channels:
                    text = str(connection.msgdef.data).encode()
                    schema = kinds.Schema(connection.id, text, "ros1msg", connection.msgtype)
                    topic = printable(connection.topic)
                    channels[connection.id] = Channel(topic, schema, "ros1", [], Payloads(spool))
                channel = channels[connection.id]
                channel.log_times.append(time)
                channel.payloads.append(bytes(data) if is_read(channel.schema.name) else b"")
    except (ReaderError, ValueError, struct.error, AssertionError) as error:
        raise UserError(f"{path}: a damaged ROS 1 bag ({error}): `rosbag reindex` it") from error
    return Container(path, list(channels.values()))


def parts_of(path: Path) -> list[Path]:
    """The files that are one recording, in order.

    Of a folder those that its metadata.yaml lists and that are there; without it all, by number.
    A file that is one of a split bag's parts stands for all of them.

    Raises:
        UserError: There is no recording, or a folder holds several.
    """
    path = Path(path)
    try:
        if path.is_dir():
            return _in_folder(path)
        if not path.is_file():
            raise UserError(f"{path}: {'is not a file' if path.exists() else 'no such file'}")
        if not path.stat().st_size:
            raise UserError(f"{path}: is empty, record it again")
        numbered = _numbered(path)
        return (numbered and _beside(path, numbered[1])) or [path]
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error


def metadata_of(path: Path) -> list[Path]:
    """The file that lists a bag's parts, where there is one."""
    parts = parts_of(path)
    file = parts[0].with_name(METADATA)
    return [file] if file.is_file() and parts[0] in _listed_files(file.parent) else []


def missing_parts(path: Path) -> list[str]:
    """List, in words, the parts of a bag that are not there. As `parts_of`."""
    parts = parts_of(path)
    if metadata_of(path):
        folder = parts[0].parent
        gone = [name for name in _listed(folder) if not _there(folder / name).is_file()]
        return [f"{name}, which {METADATA} lists, is missing" for name in gone]
    numbers = [_number(part) for part in parts]
    if len(parts) < 2:
        return []
    return [
        f"part {number} of the bag is missing"
        for number in sorted({*range(max(numbers) + 1)} - {*numbers})
    ]


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
        return _stem(path.resolve())
    numbered = _numbered(path)
    return numbered[1] if numbered and len(parts_of(path)) > 1 else _stem(path)


def sha256(path: Path) -> str:
    """Hash of the file, also where it is a bag's only one; of several parts, of their hashes."""
    digests = []
    for part in parts_of(path):
        with part.open("rb") as file:
            digests.append(hashlib.file_digest(file, "sha256").hexdigest())
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256("\n".join(digests).encode()).hexdigest()


def _in_folder(folder: Path) -> list[Path]:
    files = [file for file in _files(folder) if file.stat().st_size]
    if (folder / METADATA).is_file():
        listed = _listed_files(folder)
        parts = [file for file in listed if file in files]
        if not parts:
            names = ", ".join(file.name for file in listed[:NAMED]) or "no file"
            raise UserError(f"{folder}: {METADATA} lists {names}, of which none is there")
        return parts
    if not files:
        raise UserError(
            f"{folder}: is a folder without a recording (ros2 bag record -s mcap writes one)"
        )
    if len(files) == 1:
        return files
    stems = {numbered[1] for file in files if (numbered := _numbered(file))}
    parts = sorted(files, key=_number)
    if len(stems) == 1 and min(map(_number, files)) >= 0 and _follow(parts):
        return parts
    names = ", ".join(sorted(file.name for file in files)[:NAMED])
    raise UserError(f"{folder}: holds several recordings, name one of them: {names}")


def _beside(path: Path, stem: str) -> list[Path] | None:
    """All parts of the split bag that this file is of; None where it is of none."""
    folder = path.parent
    parts = [file for file in _files(folder) if (m := _numbered(file)) and m[1] == stem]
    if len(parts) < 2:
        return None
    if (folder / METADATA).is_file() and path in _listed_files(folder):
        return _in_folder(folder)
    parts.sort(key=_number)
    return parts if _number(parts[0]) == 0 and _follow(parts) else None


def _stem(path: Path) -> str:
    """Its name without what says that it is a recording, and packed."""
    name = PACKED_NAME.sub("", path.name)
    suffix = next((suffix for suffix in SUFFIXES if name.endswith(suffix)), "")
    return name.removesuffix(suffix)


def _files(folder: Path) -> list[Path]:
    """Recordings by their names, each once where it lies packed beside itself."""
    files = [file for file in folder.iterdir() if file.is_file()]
    files = [file for file in files if PACKED_NAME.sub("", file.name).endswith(SUFFIXES)]
    return sorted({_there(file) for file in files})


def _there(file: Path) -> Path:
    """The file, or what was unpacked of it."""
    plain = file.with_name(PACKED_NAME.sub("", file.name))
    return plain if plain.is_file() else file


def _numbered(file: Path) -> re.Match[str] | None:
    """The bag's name and the part's number, of a file that is named like a part."""
    return NUMBERED.fullmatch(_stem(file))


def _number(file: Path) -> int:
    numbered = _numbered(file)
    return int(numbered[2]) if numbered else -1


def _listed(folder: Path) -> list[str]:
    """Names of the files in a bag's metadata, by number. Raises UserError."""
    path = folder / METADATA
    try:
        content = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        listed = [printable(Path(str(name)).name) for name in names]
    except (YAMLError, ValueError, RecursionError, KeyError, TypeError) as error:
        raise UserError(
            f"{path}: is no metadata of a ROS 2 bag; without it the files are taken by number:"
            " remove it, or `ros2 bag reindex` the bag"
        ) from error
    return sorted(dict.fromkeys(listed), key=lambda name: _number(Path(name)))


def _listed_files(folder: Path) -> list[Path]:
    """The files that a bag's metadata lists, there or not. Raises UserError."""
    return [_there(folder / name) for name in _listed(folder)]


def _follow(parts: list[Path]) -> bool:
    """Whether each part begins where the one before it ends."""
    spans = [_span(part, part.stat().st_mtime_ns) for part in parts]
    return all(
        before and after and abs(after[0] - before[1]) < GAP * 1e9
        for before, after in zip(spans, spans[1:], strict=False)
    )


@lru_cache(maxsize=64)
def _span(part: Path, _written: int) -> tuple[int, int] | None:
    """Log times of the first and of the last message [ns], as its end or its chunks say."""
    times: list[int] = []
    with suppress(*DAMAGE, UserError, OSError), opened(part) as file:
        with suppress(*DAMAGE):
            summary = make_reader(file).get_summary()
            if summary and (numbers := summary.statistics):
                return numbers.message_start_time, numbers.message_end_time
        file.seek(0)  # it has no end
        for record in StreamReader(file, emit_chunks=True, record_size_limit=LIMIT).records:
            if isinstance(record, kinds.Chunk) and record.message_end_time:
                times += (record.message_start_time, record.message_end_time)
    return (min(times), max(times)) if times else None


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """The MCAP file at `path`, unpacked where zstd, gzip or LZ4 packed it, to be read.

    Raises:
        UserError: It is none.
        OSError: It cannot be read, or the temporary folder takes no more.
    """
    with path.open("rb") as file:
        first = file.read(32)
        file.seek(0)
        unpack = next((way for magic, way in PACKED.items() if first.startswith(magic)), None)
        if unpack is None:
            if not first.startswith(MAGIC):
                raise UserError(f"{path}: {_what(first)}")
            yield file
            return
        with TemporaryFile() as plain:
            # What is damaged or cut off is left out: the rest is read as far as it goes.
            with suppress(EOFError, ValueError, RuntimeError, zstandard.ZstdError):
                packed = unpack(file)
                while block := packed.read1(BLOCK):
                    plain.write(block)
            plain.seek(0)
            first = plain.read(32)
            plain.seek(0)
            if not first:
                raise UserError(f"{path}: packed, and damaged or cut off: copy it again")
            if not first.startswith(MAGIC):
                raise UserError(f"{path}: what is packed in it is {_what(first)}")
            yield plain


def _what(first: bytes) -> str:
    for magic, what in OTHERS.items():
        if first.startswith(magic):
            return what
    return "not an MCAP file or bag (ros2 bag record -s mcap writes one)"
