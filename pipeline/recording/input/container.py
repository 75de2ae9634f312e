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

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain
from os import SEEK_END
from pathlib import Path

import numpy as np
from mcap import records as kinds

from pipeline.base.errors import UserError
from pipeline.recording.input import bag
from pipeline.recording.input import records as of
from pipeline.recording.input.contents import MOST, NO_SCHEMA, Channel, Contents
from pipeline.recording.input.opened import opened
from pipeline.recording.input.standard import guessed
from pipeline.recording.input.words import counted, few

LONGEST = 86_400 * 10**9  # ns that a recording lasts
NAMED = 5  # places or topics named in one line


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
        container = _read(path, parts[0], held)[0]
        return replace(container, losses=[*bag.missing_parts(path), *container.losses])
    read = []
    for part in parts:
        container, held = _read(path, part, held)
        read.append(container)
    return _one_of(path, read)


def _read(path: Path, part: Path, held: int) -> tuple[Container, int]:
    """A file of the recording at `path`, and how many bytes are held with it, `held` before."""
    try:
        with opened(part) as file:
            contents = Contents(path, file, file.seek(0, SEEK_END), held=held)
            trusted = contents.read()
            channels, orphans = _joined(contents)
            compared = _compared(contents) if trusted else ()
            losses = [*_losses(contents), *compared, *orphans]
            return Container(path, channels, losses, _notes(contents, trusted)), contents.held
    except OSError as error:
        raise UserError(f"{part}: cannot be read ({error.strerror})") from error


def _one_of(path: Path, read: list[Container]) -> Container:
    """The parts of a bag as one recording; what is said of a part names it."""
    parts = bag.parts_of(path)
    channels = _merged(channel for container in read for channel in container.channels)
    named = list(zip(parts, read, strict=True))
    losses = [f"{part.name}: {loss}" for part, container in named for loss in container.losses]
    whole = f"all {len(parts)} parts of the bag were read, from {parts[0].name} on"
    notes = [] if path.is_dir() else [whole]
    notes += dict.fromkeys(note for container in read for note in container.notes)
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


def _joined(contents: Contents) -> tuple[list[Channel], list[str]]:
    """Channels by topic, and in words what could not be joined."""
    named, losses = [], []
    for number, channel in contents.channels.items():
        definition, count = contents.definitions.get(number), counted(len(channel.payloads))
        if definition is None:
            losses.append(f"{count} of channel {number} dropped: no record says what it is")
            continue
        schema = contents.schemas.get(definition.schema_id)
        if schema is None and definition.schema_id:
            losses.append(f"{count} of {definition.topic} dropped: its schema is missing")
            continue
        encoding = definition.message_encoding
        schema = schema or guessed(definition.topic, encoding, channel.payloads) or NO_SCHEMA
        named.append(replace(channel, topic=definition.topic, schema=schema, encoding=encoding))
    for number, count in contents.ambiguous.items():
        topic = contents.definitions[number].topic
        losses.append(
            f"channel {number} is {topic} and then another: {counted(count)} dropped since"
        )
    return _merged(named), losses


def _losses(contents: Contents) -> list[str]:
    """What may have cost messages."""
    losses = []
    data_end = contents.data_end.at if contents.data_end else contents.size
    times = _log_times(contents)

    def seconds(log_time: float) -> str:
        """Since the first message."""
        return f"{(log_time - min(times, default=log_time)) * 1e-9:.2f}"

    if contents.data_end is None:
        last = seconds(max(times, default=0.0))
        losses.append(f"the file has no end: cut off after {last} s")
    if contents.dropped:
        count = len(contents.dropped)
        where = [f"{seconds(a)} to {seconds(b)} s" for a, b in contents.dropped]
        losses.append(f"{counted(count, 'damaged chunk')} dropped: {few(where, NAMED)}")
    # What a file that was cut off ends with is no loss of its own.
    lost = [gap for gap in contents.gaps if gap.at < data_end and gap.end < contents.size]
    if lost:
        where = [f"{gap.end - gap.at} at {gap.at}" for gap in lost]
        losses.append(f"unreadable bytes of {contents.size} in the file: {few(where, NAMED)}")
    if contents.disbelieved:
        losses.append(f"{contents.disbelieved} record(s) behind them dropped: without a checksum")
    if contents.private:  # a damaged chunk may look like one
        losses.append(f"{contents.private} record(s) of kinds that are not MCAP's own passed over")
    if contents.data_end and not contents.dropped and not lost:
        wanted = contents.data_end.content.data_section_crc
        if wanted and of.crc(contents.file, 0, contents.data_end.at) != wanted:
            losses.append(
                "the checksum of all messages together does not hold: what is damaged is not known"
            )
    return losses


def _notes(contents: Contents, trusted: bool) -> list[str]:
    """What costs none; `trusted`: whether the file's summary can be believed."""
    notes = []
    if contents.shed:
        left = [d.topic for number, d in contents.definitions.items() if contents.idle(number)]
        notes.append(
            f"more than {MOST / 2**30:.0f} GiB of messages: without those of"
            f" {few(sorted(left), NAMED)}"
        )
    crcs = contents.checked or (contents.data_end and contents.data_end.content.data_section_crc)
    if not crcs:
        notes.append("no checksums in the file: damage to its messages would not be noticed")
    if contents.data_end and not trusted:
        notes.append("the summary at the file's end is damaged: its counts were not compared")
    elif contents.data_end:
        behind = [gap.end - gap.at for gap in contents.gaps if gap.at >= contents.data_end.end]
        if behind:
            notes.append(f"{sum(behind)} unreadable bytes behind the last message")
    return notes


def _compared(contents: Contents) -> list[str]:
    """Where the file's own end speaks of another length or of other numbers than were read."""
    assert contents.data_end and contents.footer  # else there is no summary to believe
    start = contents.footer.content.summary_start
    far = start and start - contents.data_end.end
    what = "missing from" if far > 0 else "too many in"
    losses = [f"{abs(far)} bytes are {what} the file"] if far else []
    statistics = [entry for entry in contents.summary if isinstance(entry, kinds.Statistics)]
    if not statistics:
        return losses
    wanted = statistics[-1].channel_message_counts
    read = {number: len(channel.payloads) for number, channel in contents.channels.items()}
    off = []
    for number in sorted({*wanted, *read}) if wanted else ():
        a, b = wanted.get(number, 0), read.get(number, 0)
        definition = contents.definitions.get(number)
        if a != b:
            of_what = definition.topic if definition else f"channel {number}"
            off.append(f"{b} of {a} of {of_what}")
    total = sum(read.values())
    if not off and total != statistics[-1].message_count:
        off.append(f"{total} of {statistics[-1].message_count}")
    if off:
        losses.append(f"messages read of those that the file counts: {few(off, NAMED)}")
    return losses


def _log_times(contents: Contents) -> np.ndarray:
    """log_times [ns] without those that are damage."""
    times = np.array([*chain.from_iterable(c.log_times for c in contents.channels.values())], float)
    return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times
