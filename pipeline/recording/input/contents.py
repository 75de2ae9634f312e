"""The records of an MCAP file: messages by channel, what names them, and what was in their way.

Which records are believed is decided here, by the rules that `container` lists; what was lost is
put into words there.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

from mcap import records as kinds
from mcap.opcode import Opcode

from pipeline.base.errors import UserError, printable
from pipeline.recording.input import records as of
from pipeline.recording.input.records import Damaged, Record

MOST = 2**30  # bytes of messages that are held at once
OVERHEAD = 256  # bytes that a message costs beside its payload
PLAYS = re.compile(  # types that may play a role; messages of others are counted, not kept
    "Wrench|Pose|Twist|JointState|FrankaState|FrankaRobotState|Image|Camera(Info|Calibration)"
    "|FrameTransform|TFMessage"
)
# Of cameras that play no role.
IDLE = re.compile(r"(?<![a-z])(infra|ir|fisheye|mask|debug)(?![a-z])")
KEPT = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
NO_SCHEMA = kinds.Schema(id=0, data=b"", encoding="", name="")


@dataclass
class Channel:
    """One topic with its raw messages, in the order of the file; those of no use are left empty."""

    topic: str
    schema: kinds.Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)  # ns
    payloads: list[bytes] = field(default_factory=list)


@dataclass
class Contents:
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

    def read(self) -> bool:
        """Read all of the file. Raises UserError. Returns whether its summary can be believed."""
        for record in of.walk(self.file, self.size):
            self._take(record)
        for record in self.aside:
            self._settle(record)
        trusted = self._summary_holds()
        for entry in self.summary if trusted else ():
            if isinstance(entry, kinds.Schema | kinds.Channel):
                self._name(entry)
        return trusted

    def idle(self, number: int) -> bool:
        """Whether a channel's topic plays no role, by its name."""
        definition = self.definitions.get(number)
        return bool(definition and IDLE.search(definition.topic.lower()))

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
        idle = idle or (self.shed and self.idle(number))
        payload = b"" if idle else data[start + of.MESSAGE.size : end]
        channel = self.channels.setdefault(number, Channel("", NO_SCHEMA, ""))
        channel.log_times.append(log_time)
        channel.payloads.append(payload)
        self._hold(len(payload) + OVERHEAD)

    def _hold(self, size: int) -> None:
        self.held += size
        if self.held > MOST and not self.shed:
            self.shed = True
            for number, channel in self.channels.items():
                if self.idle(number):
                    self.held -= sum(map(len, channel.payloads))
                    channel.payloads[:] = [b""] * len(channel.payloads)
        if self.held > MOST:
            raise UserError(
                f"{self.path}: holds more than {MOST / 2**30:.0f} GiB of messages: record only the"
                " topics that are needed, for the time of the pull, pictures compressed"
            )

    def _summary_holds(self) -> bool:
        """Whether the summary can be believed."""
        if self.data_end is None or self.footer is None:
            return False
        start, wanted = self.data_end.end, self.footer.content.summary_crc
        if not wanted:
            return not any(gap.at >= start for gap in self.gaps)
        return of.crc(self.file, start, self.footer.end - 4) == wanted


def _meaning(channel: kinds.Channel) -> tuple:
    return channel.topic, channel.message_encoding, channel.schema_id
