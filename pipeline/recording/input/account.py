"""What was lost of a file, and what else to know of it, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mcap import records as kinds

from pipeline.recording.input.records import crc

if TYPE_CHECKING:
    from pipeline.recording.input.collector import Collector

LONGEST = 86_400 * 10**9  # ns that a recording lasts
NAMED = 5  # places or topics named in one line


def losses_of(file: Collector, trusted: bool) -> list[str]:
    """What may have cost messages; `trusted`: whether the file's summary can be believed."""
    losses = []
    data_end = file.data_end.at if file.data_end else file.size
    if file.data_end is None:
        losses.append(f"the file has no end: cut off after {_seconds(file, _last(file))} s")
    if file.dropped:
        count = len(file.dropped)
        named = file.dropped[:NAMED]
        where = [f"{_seconds(file, a)} to {_seconds(file, b)} s" for a, b in named]
        losses.append(f"{count} damaged chunk{'s' * (count > 1)} dropped: {_few(where, count)}")
    # What a file that was cut off ends with is no loss of its own.
    lost = [gap for gap in file.gaps if gap.at < data_end and gap.end < file.size]
    if lost:
        where = [f"{gap.end - gap.at} at {gap.at}" for gap in lost]
        losses.append(f"unreadable bytes of {file.size} in the file: {_few(where)}")
    if file.disbelieved:
        losses.append(f"{file.disbelieved} record(s) behind them dropped: without a checksum")
    if file.private:  # a damaged chunk may look like one
        losses.append(f"{file.private} record(s) of kinds that are not MCAP's own passed over")
    if file.data_end and not file.dropped and not lost and not _data_crc_holds(file):
        losses.append(
            "the checksum of all messages together does not hold: what is damaged is not known"
        )
    return [*losses, *(_compared(file) if trusted else ())]


def notes_of(file: Collector, trusted: bool) -> list[str]:
    """What costs none."""
    notes = []
    crcs = file.checked or (file.data_end and file.data_end.content.data_section_crc)
    if not crcs:
        notes.append("no checksums in the file: damage to its messages would not be noticed")
    if file.data_end and not trusted:
        notes.append("the summary at the file's end is damaged: its counts were not compared")
    elif file.data_end:
        behind = [gap.end - gap.at for gap in file.gaps if gap.at >= file.data_end.end]
        if behind:
            notes.append(f"{sum(behind)} unreadable bytes behind the last message")
    return notes


def _data_crc_holds(file: Collector) -> bool:
    wanted = file.data_end.content.data_section_crc
    return not wanted or crc(file.file, 0, file.data_end.at) == wanted


def _compared(file: Collector) -> list[str]:
    """Where the file's own end speaks of another length or of other numbers than were read."""
    off = file.footer.content.summary_start
    off = off and off - file.data_end.end
    if off:
        what = "missing from" if off > 0 else "too many in"
        return [f"{abs(off)} bytes are {what} the file", *_counted(file)]
    return _counted(file)


def _counted(file: Collector) -> list[str]:
    found = [one for one in file.summary if isinstance(one, kinds.Statistics)]
    if not found:
        return []
    wanted = found[-1].channel_message_counts
    read = {number: len(channel.payloads) for number, channel in file.channels.items()}
    off = []
    for number in sorted({*wanted, *read}) if wanted else ():
        a, b = wanted.get(number, 0), read.get(number, 0)
        known = file.definitions.get(number)
        if a != b:
            off.append(f"{b} of {a} of {known.topic if known else f'channel {number}'}")
    total = sum(read.values())
    if not off and total != found[-1].message_count:
        off.append(f"{total} of {found[-1].message_count}")
    return [f"messages read of those that the file counts: {_few(off)}"] if off else []


def _times(file: Collector) -> np.ndarray:
    """log_times [ns] without those that are damage."""
    times = np.array([t for one in file.channels.values() for t in one.log_times], float)
    return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times


def _last(file: Collector) -> float:
    return max(_times(file), default=0.0)


def _seconds(file: Collector, log_time: float) -> str:
    """Since the first message."""
    return f"{(log_time - min(_times(file), default=log_time)) * 1e-9:.2f}"


def _few(words: list[str], count: int | None = None) -> str:
    """The first of `count` things; `words` may name those alone."""
    more = (count or len(words)) - NAMED
    return ", ".join(words[:NAMED]) + (f" and {more} more" if more > 0 else "")
