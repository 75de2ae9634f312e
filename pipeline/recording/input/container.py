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

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.recording.input.account import Channel
from pipeline.recording.input.collector import Collector
from pipeline.recording.input.records import MAGIC

__all__ = ["Channel", "Container", "expect_file", "read_container", "sha256"]


@dataclass
class Container:
    """All channels of a file, and in words what was lost of it and what else to know of it."""

    path: Path
    channels: list[Channel]
    losses: list[str]
    notes: list[str] = field(default_factory=list)


def expect_file(path: Path) -> None:
    """Raises UserError where `path` is no file with something in it."""
    if path.is_dir():
        raise UserError(f"{path}: is a folder, name the .mcap file in it")
    if not path.exists():
        raise UserError(f"{path}: no such file")
    if not path.is_file():
        raise UserError(f"{path}: is not a file")
    if not path.stat().st_size:
        raise UserError(f"{path}: is empty, record it again")


def read_container(path: Path) -> Container:
    """Read every intact message. Raises UserError where there is nothing to read."""
    path = Path(path)
    try:
        expect_file(path)
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise UserError(f"{path}: not an MCAP file (ros2 bag record -s mcap writes one)")
            return Container(path, *Collector(path, file, path.stat().st_size).collect())
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error


def sha256(path: Path) -> str:
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
