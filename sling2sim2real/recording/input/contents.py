"""The messages of an MCAP file by channel, and what was in the way of reading them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

from mcap import records as kinds
from mcap.stream_reader import CRCValidationError

from sling2sim2real.base.errors import UserError, printable
from sling2sim2real.recording.input.records import DAMAGE, records, unpacked

MOST = 2**30  # bytes of messages that are held at once
OVERHEAD = 256  # bytes that a message costs beside its payload
PLAYS = re.compile(  # types that may play a role; messages of others are counted, not kept
    "Wrench|Pose|JointState|FrankaState|FrankaRobotState|Image|Camera(Info|Calibration)"
    "|FrameTransform|TFMessage"
)
# Of cameras that play no role.
IDLE = re.compile(r"(?<![a-z])(infra|ir|fisheye|mask|debug)(?![a-z])")
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
    """What was read of a file.

    Attributes:
        held: Bytes of messages.
        shed: Whether messages of IDLE topics are left empty, for want of room.
        checked: Whether anything has a checksum.
        unchecked: Whether the checksum of all messages together does not hold.
        dropped: First and last log times of damaged chunks [ns].
        counted: Messages that the file's end speaks of; None where it does not.
        stopped: The byte at which reading had to stop; None where nothing was in its way.
        ended: Whether all messages were read before that.
    """

    path: Path
    schemas: dict[int, kinds.Schema] = field(default_factory=dict)
    definitions: dict[int, kinds.Channel] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)  # by number, not yet named
    held: int = 0
    shed: bool = False
    checked: bool = False
    unchecked: bool = False
    dropped: list[tuple[int, int]] = field(default_factory=list)
    counted: int | None = None
    stopped: int | None = None
    ended: bool = False

    def read(self, file: BinaryIO) -> None:
        """Read all of the file, or up to where it cannot be read. Raises UserError."""
        try:
            for record in records(file):
                self._take(record)
        except CRCValidationError:
            self.checked = self.unchecked = self.ended = True
        except DAMAGE:
            self.stopped = file.tell()

    def idle(self, number: int) -> bool:
        """Whether a channel's topic plays no role, by its name."""
        definition = self.definitions.get(number)
        return bool(definition and IDLE.search(definition.topic.lower()))

    def _take(self, record: kinds.McapRecord) -> None:
        if isinstance(record, kinds.Chunk):
            self.checked |= record.uncompressed_crc != 0
            try:
                inside = unpacked(record)
            except DAMAGE:
                self.dropped.append((record.message_start_time, record.message_end_time))
                return
            for part in inside:
                self._take(part)
        elif isinstance(record, kinds.Message):
            self._message(record)
        elif isinstance(record, kinds.Schema):  # the first of its number counts
            self.schemas.setdefault(record.id, replace(record, name=printable(record.name)))
        elif isinstance(record, kinds.Channel):
            self.definitions.setdefault(record.id, replace(record, topic=printable(record.topic)))
        elif isinstance(record, kinds.Statistics):
            self.counted = record.message_count
        elif isinstance(record, kinds.DataEnd):
            self.checked |= record.data_section_crc != 0
            self.ended = True

    def _message(self, message: kinds.Message) -> None:
        number = message.channel_id
        definition = self.definitions.get(number)
        schema = self.schemas.get(definition.schema_id) if definition else None
        idle = schema and schema.name and not PLAYS.search(schema.name)
        idle = idle or (self.shed and self.idle(number))
        payload = b"" if idle else message.data
        channel = self.channels.setdefault(number, Channel("", NO_SCHEMA, ""))
        channel.log_times.append(message.log_time)
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
