"""What was found in a file, and in words what was lost of it and what else to know."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap import records as kinds

from pipeline.recording.input.records import Record, crc

LONGEST = 86_400 * 10**9  # ns that a recording lasts
NAMED = 5  # places or topics named in one line


@dataclass
class Channel:
    """One topic with its raw messages, in the order of the file.

    The payloads of types that no topic needs and that are large are left empty.
    """

    topic: str
    schema: kinds.Schema
    encoding: str
    log_times: list[int] = field(default_factory=list)  # ns
    payloads: list[bytes] = field(default_factory=list)


@dataclass
class Account:
    """The records of a file, sorted.

    Attributes:
        channels: Messages by the number of their channel, not yet named.
        ambiguous: Messages dropped by channel number, because it stands for two topics.
        held: Bytes of messages.
        checked: Chunks that have a checksum.
        aside: Records not to be believed until it is known whether there are checksums.
        disbelieved: Records dropped because others have one.
        dropped: First and last log time of damaged chunks.
    """

    path: Path
    file: BinaryIO
    size: int
    schemas: dict[int, kinds.Schema] = field(default_factory=dict)
    definitions: dict[int, kinds.Channel] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    ambiguous: Counter[int] = field(default_factory=Counter)
    held: int = 0
    checked: int = 0
    aside: list[Record] = field(default_factory=list)
    disbelieved: int = 0
    gaps: list[Record] = field(default_factory=list)
    private: int = 0
    dropped: list[tuple[int, int]] = field(default_factory=list)
    data_end: Record | None = None
    footer: Record | None = None
    summary: list[kinds.McapRecord] = field(default_factory=list)

    def losses(self, trusted: bool) -> list[str]:
        """What may have cost messages; `trusted`: whether the file's summary can be believed."""
        losses = []
        data_end = self.data_end.at if self.data_end else self.size
        if self.data_end is None:
            losses.append(f"the file has no end: cut off after {self._seconds(self._last())} s")
        if self.dropped:
            count = len(self.dropped)
            named = self.dropped[:NAMED]
            where = [f"{self._seconds(a)} to {self._seconds(b)} s" for a, b in named]
            losses.append(f"{count} damaged chunk{'s' * (count > 1)} dropped: {_few(where, count)}")
        # What a file that was cut off ends with is no loss of its own.
        lost = [gap for gap in self.gaps if gap.at < data_end and gap.end < self.size]
        if lost:
            where = [f"{gap.end - gap.at} at {gap.at}" for gap in lost]
            losses.append(f"unreadable bytes of {self.size} in the file: {_few(where)}")
        if self.disbelieved:
            losses.append(f"{self.disbelieved} record(s) behind them dropped: without a checksum")
        if self.private:  # a damaged chunk may look like one
            losses.append(f"{self.private} record(s) of kinds that are not MCAP's own passed over")
        if self.data_end and not self.dropped and not lost and not self._data_crc_holds():
            losses.append(
                "the checksum of all messages together does not hold: what is damaged is not known"
            )
        return [*losses, *(self._compared() if trusted else ())]

    def notes(self, trusted: bool) -> list[str]:
        """What costs none."""
        notes = []
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

    def _data_crc_holds(self) -> bool:
        wanted = self.data_end.content.data_section_crc
        return not wanted or crc(self.file, 0, self.data_end.at) == wanted

    def _compared(self) -> list[str]:
        """Where the file's own end speaks of another length or of other numbers than were read."""
        off = self.footer.content.summary_start
        off = off and off - self.data_end.end
        if off:
            what = "missing from" if off > 0 else "too many in"
            return [f"{abs(off)} bytes are {what} the file", *self._counted()]
        return self._counted()

    def _counted(self) -> list[str]:
        found = [one for one in self.summary if isinstance(one, kinds.Statistics)]
        if not found:
            return []
        wanted = found[-1].channel_message_counts
        read = {number: len(channel.payloads) for number, channel in self.channels.items()}
        off = []
        for number in sorted({*wanted, *read}) if wanted else ():
            a, b = wanted.get(number, 0), read.get(number, 0)
            known = self.definitions.get(number)
            if a != b:
                off.append(f"{b} of {a} of {known.topic if known else f'channel {number}'}")
        total = sum(read.values())
        if not off and total != found[-1].message_count:
            off.append(f"{total} of {found[-1].message_count}")
        return [f"messages read of those that the file counts: {_few(off)}"] if off else []

    def _times(self) -> np.ndarray:
        """log_times [ns] without those that are damage."""
        times = np.array([t for one in self.channels.values() for t in one.log_times], float)
        return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times

    def _last(self) -> float:
        return max(self._times(), default=0.0)

    def _seconds(self, log_time: float) -> str:
        """Since the first message."""
        return f"{(log_time - min(self._times(), default=log_time)) * 1e-9:.2f}"


def _few(words: list[str], count: int | None = None) -> str:
    """The first of `count` things; `words` may name those alone."""
    more = (count or len(words)) - NAMED
    return ", ".join(words[:NAMED]) + (f" and {more} more" if more > 0 else "")
