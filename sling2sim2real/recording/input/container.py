"""The MCAP container: the messages of a file, also of one that was cut off or damaged.

What is wrong with a file is either a loss, which may cost messages, or a note, which costs none:

- A chunk whose checksum, size or records are wrong is dropped whole; the rest is used.
- A file without an end is read up to where it was cut, and one with bytes that are no record up to
  these.
- Where nothing has a checksum, a note says that damage would not be noticed. A checksum over the
  whole data section that does not hold is a loss of unknown place.
- Messages before their channel, or channels before their schema, find each other.
- The count in the file's statistics is held against what was read.

No index is needed, and a damaged one costs nothing. https://mcap.dev/spec
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain
from os import SEEK_END
from pathlib import Path
from typing import BinaryIO

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input import bag
from sling2sim2real.recording.input.contents import MOST, NO_SCHEMA, Channel, Contents
from sling2sim2real.recording.input.opened import opened
from sling2sim2real.recording.input.records import MAGIC
from sling2sim2real.recording.input.words import counted, few

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
            contents = Contents(path, held=held)
            contents.read(file)
            channels, orphans = _joined(contents)
            losses = [*_losses(contents, file), *orphans]
            return Container(path, channels, losses, _notes(contents)), contents.held
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
        named.append(
            replace(channel, topic=definition.topic, schema=schema or NO_SCHEMA, encoding=encoding)
        )
    return _merged(named), losses


def _losses(contents: Contents, file: BinaryIO) -> list[str]:
    """What may have cost messages; `file` was read as far as it goes."""
    losses = []
    times = _log_times(contents)

    def seconds(log_time: float) -> str:
        """Since the first message."""
        return f"{(log_time - min(times, default=log_time)) * 1e-9:.2f}"

    if contents.stopped is not None and not contents.ended:
        last = seconds(max(times, default=0.0))
        size = file.seek(0, SEEK_END)
        file.seek(max(0, size - len(MAGIC)))
        if file.read() == MAGIC:
            losses.append(
                f"cannot be read from about byte {contents.stopped} of {size} on, after {last} s"
                " (`mcap recover` may get more of it)"
            )
        else:
            losses.append(f"the file has no end: cut off after {last} s")
    if contents.dropped:
        count = len(contents.dropped)
        where = [f"{seconds(a)} to {seconds(b)} s" for a, b in contents.dropped]
        losses.append(f"{counted(count, 'damaged chunk')} dropped: {few(where, NAMED)}")
    elif contents.unchecked:
        losses.append(
            "the checksum of all messages together does not hold: what is damaged is not known"
        )
    read = sum(len(channel.payloads) for channel in contents.channels.values())
    if contents.counted not in (None, read):
        losses.append(f"messages read of those that the file counts: {read} of {contents.counted}")
    return losses


def _notes(contents: Contents) -> list[str]:
    """What costs none."""
    notes = []
    if contents.shed:
        left = [d.topic for number, d in contents.definitions.items() if contents.idle(number)]
        notes.append(
            f"more than {MOST / 2**30:.0f} GiB of messages: without those of"
            f" {few(sorted(left), NAMED)}"
        )
    if not contents.checked:
        notes.append("no checksums in the file: damage to its messages would not be noticed")
    if contents.stopped is not None and contents.ended:
        notes.append("the summary at the file's end is damaged: its counts were not compared")
    return notes


def _log_times(contents: Contents) -> np.ndarray:
    """log_times [ns] without those that are damage."""
    times = np.array([*chain.from_iterable(c.log_times for c in contents.channels.values())], float)
    return times[np.abs(times - np.median(times)) < LONGEST] if len(times) else times
