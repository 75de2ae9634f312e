"""A file as the MCAP that is in it, which may be packed; what else it is, by its first bytes."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, BinaryIO

import lz4.frame
import zstandard

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.input.records import MAGIC

MOST = 2**32  # bytes of what was packed
BLOCK = 2**16
PACKED: dict[bytes, Callable[[BinaryIO], Any]] = {
    b"\x28\xb5\x2f\xfd": lambda file: zstandard.ZstdDecompressor().stream_reader(
        file, read_across_frames=True, closefd=False
    ),
    b"\x1f\x8b": lambda file: gzip.GzipFile(fileobj=file),
    b"\x04\x22\x4d\x18": lambda file: lz4.frame.LZ4FrameFile(file),
}
OTHERS = {  # what it is, and how to mend it
    b"version https://git-lfs": "a Git LFS pointer, not the recording: `git lfs pull` fetches it",
    b"#ROSBAG V2.0": "a ROS 1 bag: `rosbags-convert --src {} --dst FOLDER --dst-storage mcap`",
    b"SQLite format 3": "a ROS 2 bag in SQLite: `ros2 bag convert` its folder to mcap, or record"
    " with `ros2 bag record -s mcap`",
    b"PK\x03\x04": "a ZIP archive: unpack it",
    b"\xfd7zXZ": "packed by xz: unpack it",
    b"BZh": "packed by bzip2: unpack it",
    b"7z\xbc\xaf": "packed by 7-Zip: unpack it",
}


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
        unpack = next(
            (unpacker for magic, unpacker in PACKED.items() if first.startswith(magic)), None
        )
        if unpack is None:
            if not first.startswith(MAGIC):
                raise UserError(f"{path}: {_what(first, path)}")
            yield file
            return
        with TemporaryFile() as plain:
            _unpack(path, unpack(file), plain)
            plain.seek(0)
            first = plain.read(32)
            if not first:
                raise UserError(f"{path}: packed, and damaged or cut off: copy it again")
            if not first.startswith(MAGIC):
                raise UserError(f"{path}: what is packed in it is {_what(first, path)}")
            yield plain


def is_mcap(path: Path) -> bool:
    """Whether `opened` would have it, without unpacking all of it. Raises OSError."""
    with path.open("rb") as file:
        first = file.read(32)
    return first.startswith((MAGIC, *PACKED))


def _what(first: bytes, path: Path) -> str:
    for magic, what in OTHERS.items():
        if first.startswith(magic):
            return what.format(path)
    return "not an MCAP file (ros2 bag record -s mcap writes one)"


def _unpack(path: Path, packed: Any, plain: BinaryIO) -> None:
    """What is damaged or cut off is left out: the container is read as far as it goes."""
    size = 0
    while True:
        try:
            block = packed.read1(BLOCK)
        except (EOFError, ValueError, RuntimeError, zstandard.ZstdError, gzip.BadGzipFile):
            return
        if not block:
            return
        size += len(block)
        if size > MOST:
            raise UserError(f"{path}: unpacks to more than {MOST / 2**30:.0f} GiB")
        plain.write(block)
