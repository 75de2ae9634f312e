"""Records of an MCAP file, read by mcap's own reader, with no size taken on trust.

The library believes every length, and returns what is there where less is left than was asked for.
Here no record and no chunk may ask for more than LIMIT, and what is short is damage.
https://mcap.dev/spec
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import replace
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk

MAGIC = b"\x89MCAP0\r\n"
LIMIT = 2**29  # bytes of one record, or of one chunk when it is unpacked
# What reading raises where bytes are no record, or a checksum does not hold.
DAMAGE = (McapError, struct.error, ValueError, MemoryError, OverflowError)


class _Whole:
    """A file that never returns less than was asked for."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file

    def read(self, size: int) -> bytes:
        data = self.file.read(size) if 0 <= size <= LIMIT else b""
        if len(data) < size:
            raise EndOfFile
        return data


def records(file: BinaryIO) -> Iterator[McapRecord]:
    """All records of a file; a chunk is one. Raises DAMAGE."""
    file.seek(0)
    whole: BinaryIO = _Whole(file)  # pyright: ignore[reportAssignmentType]
    reader = StreamReader(whole, emit_chunks=True, validate_crcs=True, record_size_limit=LIMIT)
    return reader.records


def unpacked(chunk: Chunk) -> list[McapRecord]:
    """The records in a chunk. Raises DAMAGE, also where its checksum does not hold."""
    if chunk.uncompressed_size > LIMIT:
        raise ValueError("a chunk that is too large")
    try:
        data = _decompressed(chunk.compression, chunk.data, chunk.uncompressed_size)
    except (zstandard.ZstdError, RuntimeError) as error:
        raise ValueError(str(error)) from error
    if len(data) != chunk.uncompressed_size:
        raise ValueError("a chunk of another size than it says")
    return breakup_chunk(replace(chunk, compression="", data=data), validate_crc=True)


def _decompressed(compression: str, packed: bytes, size: int) -> bytes:
    """Unpack zstd or lz4 to at most one byte more than `size`, whatever its frame says."""
    if compression == "zstd":
        stream = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
        return stream.read(size) + stream.read(1)
    if compression == "lz4":
        return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    if compression:
        raise ValueError(f"compression {compression!r} is not known")
    return packed
