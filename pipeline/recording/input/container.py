"""The MCAP container: every intact message of a file, also of one that was cut off or damaged.

What is wrong with a file is either a loss, which may cost messages, or a note, which costs none:

- A chunk whose checksum, size or records are wrong is dropped whole; the rest is used.
- Where a record cannot be, reading goes on at the next one that can.
- A file without an end is read up to where it was cut.
- A chunk without a checksum is dropped if other chunks have one. Where nothing has any, a note says
  that damage would not be noticed. A checksum over the whole data section that does not hold, where
  no chunk is known to be damaged, is a loss of unknown place.
- What stands outside of chunks behind such a place is not believed where chunks have checksums.
- Messages before their channel, or channels before their schema, find each other. A channel id that
  stands for two topics is used up to the second one.
- The counts in the file's statistics are held against what was read.

No index is needed, and a damaged one costs nothing. https://mcap.dev/spec
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain
from os import SEEK_END
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap import records as kinds
from mcap.opcode import Opcode

from pipeline.base.errors import UserError, printable
from pipeline.recording.input import bag
from pipeline.recording.input import records as of
from pipeline.recording.input.opened import opened
from pipeline.recording.input.records import Damaged, Record
from pipeline.recording.input.standard import guessed
from pipeline.recording.input.words import counted, few

MOST = 2**30  # bytes of messages that are held at once
OVERHEAD = 256  # bytes that a message costs beside its payload
PLAYS = re.compile(  # types that may play a role; messages of others are counted, not kept
    "Wrench|Pose|Twist|JointState|FrankaState|FrankaRobotState|Image|Camera(Info|Calibration)"
    "|FrameTransform|TFMessage"
)
# Of cameras that play no role.
IDLE = re.compile(r"(?<![a-z])(infra|ir|fisheye|mask|debug)(?![a-z])")
LONGEST = 86_400 * 10**9  # ns that a recording lasts
KEPT = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
NO_SCHEMA = kinds.Schema(id=0, data=b"", encoding="", name="")
NAMED = 5  # places or topics named in one line


@dataclass
class Channel:
    """One topic with its raw messages, in the order of the file; those of no use are left empty."""

    topic: str
    schema: kinds.Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)  # ns
    payloads: list[bytes] = field(default_factory=list)


@dataclass
class Container:
    """All channels of a file, and in words what was lost of it and what else to know of it."""

    path: Path
    channels: list[Channel]
    losses: list[str]
    notes: list[str] = field(default_factory=list)


def read_container(path: Path) -> Container:
    """Read every intact message, of all parts of a bag. Raises UserError: nothing is to be read."""
    path = Path(path)
    parts, held = bag.parts_of(path), 0
    if len(parts) == 1:
        contents = _read(path, parts[0], held)[0]
        return replace(contents, losses=[*bag.missing_parts(path), *contents.losses])
    read = []
    for part in parts:
        contents, held = _read(path, part, held)
        read.append(contents)
    return _one_of(path, read)


def _read(path: Path, part: Path, held: int) -> tuple[Container, int]:
    """A file of the recording at `path`, and how many bytes are held with it, `held` before."""
    try:
        with opened(part) as file:
            contents = _Contents(path, file, file.seek(0, SEEK_END), held=held)
            return contents.container(), contents.held
    except OSError as error:
        raise UserError(f"{part}: cannot be read ({error.strerror})") from error


def _one_of(path: Path, read: list[Container]) -> Container:
    """The parts of a bag as one recording; what is said of a part names it."""
    parts = bag.parts_of(path)
    channels = _merged(channel for container in read for channel in container.channels)
    named = list(zip(parts, read, strict=True))
    losses = [f"{part.name}: {loss}" for part, contents in named for loss in contents.losses]
    whole = f"all {len(parts)} parts of the bag were read, from {parts[0].name} on"
    notes = [] if path.is_dir() else [whole]
    notes += dict.fromkeys(note for contents in read for note in contents.notes)
    return Container(path, channels, [*bag.missing_parts(path), *losses], notes)


def _merged(channels: Iterable[Channel]) -> list[Channel]:
    """Channels of one topic, schema and encoding as one."""
    by_kind: dict[tuple, Channel] = {}
    for channel in channels:
        schema = channel.schema
        kind = channel.topic, schema.name, schema.encoding, schema.data, channel.encoding
        merged = by_kind.setdefault(kind, replace(channel, log_times=[], payloads=[]))
        merged.log_times += channel.log_times
        merged.payloads += channel.payloads
    return list(by_kind.values())


@dataclass
class _Contents:
    """The records of a file, sorted."""

    path: Path
    file: BinaryIO
    size: int
    schemas: dict[int, kinds.Schema] = field(default_factory=dict)
    definitions: dict[int, kinds.Channel] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)  # by number, not yet named
    ambiguous: Counter[int] = field(default_factory=Counter)  # dropped of numbers with two topics
    held: int = 0  # bytes of messages
    shed: bool = False  # whether messages of IDLE topics are left empty, for want of room
    checked: int = 0  # chunks that have a checksum
    aside: list[Record] = field(default_factory=list)  # believed only where there are no checksums
    disbelieved: int = 0
    gaps: list[Record] = field(default_factory=list)
    private: int = 0
    dropped: list[tuple[int, int]] = field(default_factory=list)  # log times of damaged chunks
    data_end: Record | None = None
    footer: Record | None = None
    summary: list[kinds.McapRecord] = field(default_factory=list)

    def container(self) -> Container:
        for record in of.walk(self.file, self.size):
            self._take(record)
        for record in self.aside:
            self._settle(record)
        trusted = self._summary_holds()
        for entry in self.summary if trusted else ():
            if isinstance(entry, kinds.Schema | kinds.Channel):
                self._name(entry)
        channels, orphans = self._joined()
        losses = [*self._losses(), *(self._compared() if trusted else ()), *orphans]
        return Container(self.path, channels, losses, self._notes(trusted))

    # Records

    def _take(self, record: Record) -> None:
        """One record outside of chunks."""
        opcode, content = record.opcode, record.content
        if not opcode:
            self.gaps.append(record)
        elif opcode == Opcode.CHUNK and content.uncompressed_crc:
            self.checked += 1
            self._use(opcode, content)
        elif opcode == Opcode.DATA_END:
            self.data_end = record
        elif opcode == Opcode.FOOTER:
            self.footer = record
        elif self.data_end and opcode not in (Opcode.CHUNK, Opcode.MESSAGE):
            self.summary.append(content)
        elif opcode == Opcode.CHUNK or (self.gaps and opcode in KEPT):
            self.aside.append(record._replace(content=None))
        elif opcode >= of.PRIVATE:
            self.private += 1
        else:
            self._use(opcode, content)

    def _settle(self, record: Record) -> None:
        """A record that was put aside: believed only where nothing has a checksum."""
        start = record.at + of.HEAD.size
        content: Any = of.read(self.file, start, record.end - start)
        if record.opcode != Opcode.MESSAGE:
            content = of.parse(record.opcode, content)
        if not self.checked:
            self._use(record.opcode, content)
        elif record.opcode == Opcode.CHUNK:
            self.dropped.append((content.message_start_time, content.message_end_time))
        else:
            self.disbelieved += 1

    def _use(self, opcode: int, content: Any) -> None:
        """`content` as in `Record`."""
        if opcode == Opcode.MESSAGE:
            self._message(content, 0, len(content))
        elif opcode == Opcode.SCHEMA:
            self._name(content)
        elif opcode == Opcode.CHANNEL:
            self._name(content)
            definition = self.definitions[content.id]
            if _meaning(definition) != _meaning(replace(content, topic=printable(content.topic))):
                self.ambiguous.setdefault(content.id, 0)
        elif opcode == Opcode.CHUNK:
            try:
                self._open(of.unpack(content))
            except Damaged:
                self.dropped.append((content.message_start_time, content.message_end_time))

    def _name(self, definition: kinds.Schema | kinds.Channel) -> None:
        """The first schema or channel of its number counts, by a name that can be shown."""
        if isinstance(definition, kinds.Schema):
            shown = replace(definition, name=printable(definition.name))
            self.schemas.setdefault(shown.id, shown)
        else:
            shown = replace(definition, topic=printable(definition.topic))
            self.definitions.setdefault(shown.id, shown)

    def _open(self, data: bytes) -> None:
        """The records of a chunk. Raises Damaged."""
        for opcode, start, end in of.inside(data):
            if opcode == Opcode.MESSAGE:
                self._message(data, start, end)
            elif opcode in KEPT:
                self._use(opcode, of.parse(opcode, data[start:end]))
            else:
                self._hold(OVERHEAD)  # no end of tiny records either

    def _message(self, data: bytes, start: int, end: int) -> None:
        if end - start < of.MESSAGE.size:
            raise Damaged("a message that is too short")
        number, _, log_time, _ = of.MESSAGE.unpack_from(data, start)
        if number in self.ambiguous:
            self.ambiguous[number] += 1
            return
        definition = self.definitions.get(number)
        schema = self.schemas.get(definition.schema_id) if definition else None
        idle = schema and schema.name and not PLAYS.search(schema.name)
        idle = idle or (self.shed and self._idle(number))
        payload = b"" if idle else data[start + of.MESSAGE.size : end]
        channel = self.channels.setdefault(number, Channel("", NO_SCHEMA, ""))
        channel.log_times.append(log_time)
        channel.payloads.append(payload)
        self._hold(len(payload) + OVERHEAD)

    def _idle(self, number: int) -> bool:
        """Whether a channel's topic plays no role, by its name."""
        definition = self.definitions.get(number)
        return bool(definition and IDLE.search(definition.topic.lower()))

    def _hold(self, size: int) -> None:
        self.held += size
        if self.held > MOST and not self.shed:
            self.shed = True
            for number, channel in self.channels.items():
                if self._idle(number):
                    self.held -= sum(map(len, channel.payloads))
                    channel.payloads[:] = [b""] * len(channel.payloads)
        if self.held > MOST:
            raise UserError(
                f"{self.path}: holds more than {MOST / 2**30:.0f} GiB of messages: record only the"
                " topics that are needed, for the time of the pull, pictures compressed"
            )

    # What they amount to

    def _joined(self) -> tuple[list[Channel], list[str]]:
        """Channels by topic, and in words what could not be joined."""
        named, losses = [], []
        for number, channel in self.channels.items():
            definition, count = self.definitions.get(number), counted(len(channel.payloads))
            if definition is None:
                losses.append(f"{count} of channel {number} dropped: no record says what it is")
                continue
            schema = self.schemas.get(definition.schema_id)
            if schema is None and definition.schema_id:
                losses.append(f"{count} of {definition.topic} dropped: its schema is missing")
                continue
            encoding = definition.message_encoding
            schema = schema or guessed(definition.topic, encoding, channel.payloads) or NO_SCHEMA
            named.append(replace(channel, topic=definition.topic, schema=schema, encoding=encoding))
        for number, count in self.ambiguous.items():
            topic = self.definitions[number].topic
            losses.append(
                f"channel {number} is {topic} and then another: {counted(count)} dropped since"
            )
        return _merged(named), losses

    def _summary_holds(self) -> bool:
        """Whether the summary can be believed."""
        if self.data_end is None or self.footer is None:
            return False
        start, wanted = self.data_end.end, self.footer.content.summary_crc
        if not wanted:
            return not any(gap.at >= start for gap in self.gaps)
        return of.crc(self.file, start, self.footer.end - 4) == wanted

    def _losses(self) -> list[str]:
        """What may have cost messages."""
        losses = []
        data_end = self.data_end.at if self.data_end else self.size
        times = self._log_times()

        def seconds(log_time: float) -> str:
            """Since the first message."""
            return f"{(log_time - min(times, default=log_time)) * 1e-9:.2f}"

        if self.data_end is None:
            last = seconds(max(times, default=0.0))
            losses.append(f"the file has no end: cut off after {last} s")
        if self.dropped:
            count = len(self.dropped)
            where = [f"{seconds(a)} to {seconds(b)} s" for a, b in self.dropped]
            losses.append(f"{counted(count, 'damaged chunk')} dropped: {few(where, NAMED)}")
        # What a file that was cut off ends with is no loss of its own.
        lost = [gap for gap in self.gaps if gap.at < data_end and gap.end < self.size]
        if lost:
            where = [f"{gap.end - gap.at} at {gap.at}" for gap in lost]
            losses.append(f"unreadable bytes of {self.size} in the file: {few(where, NAMED)}")
        if self.disbelieved:
            losses.append(f"{self.disbelieved} record(s) behind them dropped: without a checksum")
        if self.private:  # a damaged chunk may look like one
            losses.append(f"{self.private} record(s) of kinds that are not MCAP's own passed over")
        if self.data_end and not self.dropped and not lost:
            wanted = self.data_end.content.data_section_crc
            if wanted and of.crc(self.file, 0, self.data_end.at) != wanted:
                losses.append(
                    "the checksum of all messages together does not hold: what is damaged is not"
                    " known"
                )
        return losses

    def _notes(self, trusted: bool) -> list[str]:
        """What costs none; `trusted`: whether the file's summary can be believed."""
        notes = []
        if self.shed:
            left = [d.topic for number, d in self.definitions.items() if self._idle(number)]
            notes.append(
                f"more than {MOST / 2**30:.0f} GiB of messages: without those of"
                f" {few(sorted(left), NAMED)}"
            )
        crcs = self.checked or (self.data_end and self.data_end.content.data_section_crc)
        if not crcs:
            notes.append("no checksums in the file: damage to its messages would not be noticed")
        if self.data_end and not trusted:
            notes.append("the summary at the file's end is damaged: its counts were not compared")
        elif self.data_end:
            behind = [gap.end - gap.at for gap in self.gaps if gap.at >= self.data_end.end]
            if behind:
                notes.append(f"{sum(behind)} unreadable bytes behind the last message")
        return notes

    def _compared(self) -> list[str]:
        """Where the file's own end speaks of another length or of other numbers than were read."""
        assert self.data_end and self.footer  # else there is no summary to believe
        start = self.footer.content.summary_start
        far = start and start - self.data_end.end
        what = "missing from" if far > 0 else "too many in"
        losses = [f"{abs(far)} bytes are {what} the file"] if far else []
        statistics = [entry for entry in self.summary if isinstance(entry, kinds.Statistics)]
        if not statistics:
            return losses
        wanted = statistics[-1].channel_message_counts
        read = {number: len(channel.payloads) for number, channel in self.channels.items()}
        off = []
        for number in sorted({*wanted, *read}) if wanted else ():
            a, b = wanted.get(number, 0), read.get(number, 0)
            definition = self.definitions.get(number)
            if a != b:
                of_what = definition.topic if definition else f"channel {number}"
                off.append(f"{b} of {a} of {of_what}")
        total = sum(read.values())
        if not off and total != statistics[-1].message_count:
            off.append(f"{total} of {statistics[-1].message_count}")
        if off:
            losses.append(f"messages read of those that the file counts: {few(off, NAMED)}")
        return losses

    def _log_times(self) -> np.ndarray:
        """log_times [ns] without those that are damage."""
        times = np.array([*chain.from_iterable(c.log_times for c in self.channels.values())], float)
        return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times


def _meaning(channel: kinds.Channel) -> tuple:
    return channel.topic, channel.message_encoding, channel.schema_id
