"""What the records of a file amount to: channels with their messages, and what was lost on the way.

The rules are in `container`.
"""

from __future__ import annotations

import re

from mcap import records as kinds
from mcap.opcode import Opcode

from pipeline.base.errors import UserError
from pipeline.recording.input.account import Account, Channel
from pipeline.recording.input.records import (
    HEAD,
    MESSAGE,
    PRIVATE,
    Damaged,
    Record,
    crc,
    inside,
    parse,
    unpack,
    walk,
)

MOST = 2**30  # bytes of messages that are held at once
OVERHEAD = 256  # bytes that a message costs beside its payload
BULKY = re.compile("PointCloud|LaserScan|OccupancyGrid|CompressedVideo")  # counted, not kept
KEPT = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)


class Collector(Account):
    """Takes one record after the other; then says what it has."""

    def collect(self) -> tuple[list[Channel], list[str], list[str]]:
        """Channels that have messages, losses and notes."""
        for record in walk(self.file, self.size):
            self._take(record)
        for record in self.aside:
            self._settle(record)
        trusted = self._summary_holds()
        for one in self.summary if trusted else ():
            if isinstance(one, kinds.Schema):
                self.schemas.setdefault(one.id, one)
            elif isinstance(one, kinds.Channel):
                self.definitions.setdefault(one.id, one)
        channels, orphans = self._joined()
        return channels, [*self.losses(trusted), *orphans], self.notes(trusted)

    # Records

    def _take(self, record: Record) -> None:
        """One record outside of chunks."""
        opcode, content = record.opcode, record.content
        if not opcode:
            self.gaps.append(record)
        elif opcode == Opcode.CHUNK and content.uncompressed_crc:
            self.checked += 1
            self._open(content)
        elif opcode == Opcode.DATA_END:
            self.data_end = record
        elif opcode == Opcode.FOOTER:
            self.footer = record
        elif self.data_end and opcode not in (Opcode.CHUNK, Opcode.MESSAGE):
            self.summary.append(content)
        elif opcode == Opcode.CHUNK or (self.gaps and opcode in KEPT):
            self.aside.append(record._replace(content=None))
        elif opcode == Opcode.MESSAGE:
            self._message(content, 0, len(content))
        elif opcode in KEPT:
            self._define(content)
        elif opcode >= PRIVATE:
            self.private += 1

    def _settle(self, record: Record) -> None:
        """A record that was put aside: believed only where nothing has a checksum."""
        self.file.seek(record.at + HEAD.size)
        content = self.file.read(record.end - record.at - HEAD.size)
        if record.opcode == Opcode.CHUNK:
            chunk = parse(record.opcode, content)
            if self.checked:
                self.dropped.append(_span(chunk))
            else:
                self._open(chunk)
        elif self.checked:
            self.disbelieved += 1
        elif record.opcode == Opcode.MESSAGE:
            self._message(content, 0, len(content))
        else:
            self._define(parse(record.opcode, content))

    def _open(self, chunk: kinds.Chunk) -> None:
        try:
            data = unpack(chunk)
            for opcode, start, end in inside(data):
                if opcode == Opcode.MESSAGE:
                    self._message(data, start, end)
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._define(parse(opcode, data[start:end]))
                else:
                    self._hold(OVERHEAD)  # no end of tiny records either
        except Damaged:
            self.dropped.append(_span(chunk))

    def _define(self, record: kinds.McapRecord) -> None:
        if isinstance(record, kinds.Schema):
            self.schemas.setdefault(record.id, record)
        elif isinstance(record, kinds.Channel):
            known = self.definitions.setdefault(record.id, record)
            if _meaning(known) != _meaning(record):
                self.ambiguous.setdefault(record.id, 0)

    def _message(self, data: bytes, start: int, end: int) -> None:
        if end - start < MESSAGE.size:
            raise Damaged("a message that is too short")
        number, _, log_time, _ = MESSAGE.unpack_from(data, start)
        if number in self.ambiguous:
            self.ambiguous[number] += 1
            return
        channel = self.channels.get(number)
        if channel is None:
            channel = self.channels[number] = Channel("", None, "")
        bulky = self._is_bulky(number)
        payload = b"" if bulky else data[start + MESSAGE.size : end]
        self._hold(len(payload) + OVERHEAD)
        channel.log_times.append(log_time)
        channel.payloads.append(payload)

    def _is_bulky(self, number: int) -> bool:
        known = self.definitions.get(number)
        schema = self.schemas.get(known.schema_id) if known else None
        return bool(schema and BULKY.search(schema.name))

    def _hold(self, size: int) -> None:
        self.held += size
        if self.held > MOST:
            raise UserError(
                f"{self.path}: holds more than {MOST / 2**30:.0f} GiB of messages: record only the"
                " topics that are needed, for the time of the pull, pictures compressed"
            )

    # Joining

    def _joined(self) -> tuple[list[Channel], list[str]]:
        """Channels by topic, and in words what could not be joined."""
        found: dict[tuple, Channel] = {}
        losses = []
        for number, channel in self.channels.items():
            known, count = self.definitions.get(number), _messages(len(channel.payloads))
            if known is None:
                losses.append(f"{count} of channel {number} dropped: no record says what it is")
                continue
            schema = self.schemas.get(known.schema_id)
            if schema is None and known.schema_id:
                losses.append(f"{count} of {known.topic} dropped: its schema is missing")
                continue
            schema = schema or kinds.Schema(id=0, data=b"", encoding="", name="")
            key = (known.topic, schema.name, schema.encoding, schema.data, known.message_encoding)
            one = found.setdefault(key, Channel(known.topic, schema, known.message_encoding))
            one.log_times += channel.log_times
            one.payloads += channel.payloads
        for number, count in self.ambiguous.items():
            topic = self.definitions[number].topic
            losses.append(
                f"channel {number} is {topic} and then another: {_messages(count)} dropped since"
            )
        return list(found.values()), losses

    def _summary_holds(self) -> bool:
        """Whether the summary can be believed."""
        if self.data_end is None or self.footer is None:
            return False
        start, wanted = self.data_end.end, self.footer.content.summary_crc
        if not wanted:
            return not any(gap.at >= start for gap in self.gaps)
        return crc(self.file, start, self.footer.end - 4) == wanted


def _span(chunk: kinds.Chunk) -> tuple[int, int]:
    return chunk.message_start_time, chunk.message_end_time


def _meaning(channel: kinds.Channel) -> tuple:
    return channel.topic, channel.message_encoding, channel.schema_id


def _messages(count: int) -> str:
    return f"{count} message{'s' * (count != 1)}"
