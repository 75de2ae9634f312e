"""Records of an MCAP file, one after the other, with nothing in them taken on trust.

`mcap.stream_reader` believes the lengths that it reads and stops at the first wrong one: of 600
damaged files (validation/campaigns/mutations.py) it loses 109 that here become an episode. Here a
record that cannot be is stepped over to the next one that can, and no size field, of a record, a
chunk or a compressed frame, asks for more memory than CHUNK_LIMIT. What the records hold is read by
the library, from a stream that does not hand out less than was asked for.
https://mcap.dev/spec
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from typing import Any, BinaryIO, NamedTuple

import lz4.frame
import zstandard
from mcap import records as kinds
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
CHUNK_LIMIT = 2**29  # bytes of one chunk or message, packed or not
HEAD = struct.Struct("<BQ")  # opcode and length of a record
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time; the payload follows
CHUNK = struct.Struct("<QQQII")  # start, end, size, CRC, length of the compression's name
DATA = re.compile(rb"(?=[\x05\x06].{4}\x00{4})", re.DOTALL)  # may begin a message or a chunk
BLOCK, LEAST_BLOCK = 2**20, 2**12
PRIVATE = 0x80  # and above: records of applications

READERS = {  # but for messages, whose payloads are taken as they are
    opcode: getattr(kinds, opcode.name.title().replace("_", "")).read
    for opcode in Opcode
    if opcode not in (Opcode.MESSAGE, Opcode.MESSAGE_INDEX)
}


class Damaged(Exception):
    """Bytes that are no record; the message says why."""


class Record(NamedTuple):
    """One record of the file.

    Attributes:
        at, end: Its first byte and the one behind it.
        opcode: 0 stands for bytes that are no record.
        content: The bytes of a message, else what they say, or None where nobody needs it.
    """

    at: int
    end: int
    opcode: int
    content: Any = None  # bytes or kinds.McapRecord, by the opcode


class _Whole(ReadDataStream):
    """Raises where the library's stream would quietly return less than was asked for."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) < length:
            raise EndOfFile
        return data


def read(file: BinaryIO, at: int, length: int) -> bytes:
    file.seek(at)
    return file.read(length)


def parse(opcode: int, content: bytes) -> kinds.McapRecord:
    """What a record says. Raises Damaged."""
    stream = _Whole(BytesIO(content))
    try:
        record = READERS[Opcode(opcode)](stream)
    except (McapError, struct.error, ValueError, MemoryError, OverflowError) as error:
        raise Damaged(f"a record of kind {opcode} that cannot be read") from error
    if stream.count != len(content):
        raise Damaged(f"a record of kind {opcode} with a wrong length")
    return record


def walk(file: BinaryIO, size: int) -> Iterator[Record]:
    """All records behind the magic, and what is unreadable between them as opcode 0."""
    at = len(MAGIC)
    while at < size:
        record = _record(file, at, size)
        if record is None:
            after = _resume(file, at + 1, size)
            yield Record(at, after, 0)
            at = after
            continue
        yield record
        at = record.end
        if record.opcode == Opcode.FOOTER:
            if read(file, at, len(MAGIC)) != MAGIC:
                yield Record(at, size, 0)
            elif at + len(MAGIC) < size:
                yield Record(at + len(MAGIC), size, 0)
            return


def inside(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(opcode, start, end) of the content of each record in a chunk. Raises Damaged."""
    at, size = 0, len(data)
    while at < size:
        if at + HEAD.size > size:
            raise Damaged("a chunk that ends within a record")
        opcode, length = HEAD.unpack_from(data, at)
        at += HEAD.size
        if not opcode or length > size - at:
            raise Damaged("a record with a wrong length in a chunk")
        yield opcode, at, at + length
        at += length


def unpack(chunk: kinds.Chunk) -> bytes:
    """The records of a chunk, checked against its CRC if it has one. Raises Damaged."""
    size = chunk.uncompressed_size
    if size > CHUNK_LIMIT:
        raise Damaged(f"a chunk that claims {size} bytes")
    try:
        data = _decompressed(chunk.compression, chunk.data, size)
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError) as error:
        raise Damaged(f"a chunk that cannot be decompressed ({error})") from error
    if len(data) != size:
        raise Damaged("a chunk of another size than it says")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise Damaged("a chunk with a wrong checksum")
    return data


def crc(file: BinaryIO, start: int, end: int) -> int:
    """CRC32 of a part of the file."""
    file.seek(start)
    value, left = 0, end - start
    while left > 0 and (block := file.read(min(BLOCK, left))):
        value, left = zlib.crc32(block, value), left - len(block)
    return value


def _decompressed(compression: str, packed: bytes, size: int) -> bytes:
    """Unpack zstd or lz4 to at most one byte more than `size`, whatever its frame says of itself.

    What is not compressed is returned as it is, of any length. Raises ValueError where the
    compression is not known, or lz4's end is missing; and what the libraries raise.
    """
    if compression == "zstd":
        stream = zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
        return stream.read(size) + stream.read(1)
    if compression == "lz4":
        stream = lz4.frame.LZ4FrameDecompressor()
        data = stream.decompress(packed, max_length=size + 1)
        if not stream.eof:
            raise ValueError("its end is missing")
        return data
    if compression:
        raise ValueError(f"compression {compression!r} is not known")
    return packed


def _record(file: BinaryIO, at: int, size: int) -> Record | None:
    """The record at a place, None where there cannot be one."""
    head = read(file, at, HEAD.size)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack(head)
    start, end = at + HEAD.size, at + HEAD.size + length
    if not opcode or end > size:
        return None
    if opcode >= PRIVATE or (opcode == Opcode.ATTACHMENT and length > CHUNK_LIMIT):
        return Record(at, end, opcode)  # of no use, and of any size
    if opcode > max(Opcode) or length > CHUNK_LIMIT:
        return None
    if opcode == Opcode.CHUNK and not _is_chunk(read(file, start, CHUNK.size + 12), length):
        return None
    content = read(file, start, length)
    if opcode == Opcode.MESSAGE:
        return Record(at, end, opcode, content) if length >= MESSAGE.size else None
    if opcode == Opcode.MESSAGE_INDEX:  # there are many, and no need of what they say
        return Record(at, end, opcode) if _is_index(content) else None
    try:
        return Record(at, end, opcode, parse(opcode, content))
    except Damaged:
        return None


def _is_chunk(head: bytes, length: int) -> bool:
    """Whether the lengths within a chunk's record agree."""
    if len(head) < CHUNK.size + 8 or length < CHUNK.size + 8:
        return False
    name = CHUNK.unpack_from(head)[-1]
    if name > 4:
        return False  # neither nothing nor lz4 nor zstd
    (packed,) = struct.unpack_from("<Q", head + bytes(8), CHUNK.size + name)
    return packed == length - CHUNK.size - 8 - name


def _is_index(content: bytes) -> bool:
    """Channel, then the length of the entries, 16 bytes each."""
    if len(content) < 6:
        return False
    (length,) = struct.unpack_from("<I", content, 2)
    return length == len(content) - 6 and length % 16 == 0


def _resume(file: BinaryIO, at: int, size: int) -> int:
    """The next place at which a chunk, or a message followed by a record, can begin."""
    length = LEAST_BLOCK  # most damage is small, and there may be much of it
    while at < size:
        block = read(file, at, length + HEAD.size)
        for match in DATA.finditer(block):
            first = match.start()
            if first < length and _begins(file, at + first, size, *HEAD.unpack_from(block, first)):
                return at + first
        at += length
        length = min(4 * length, BLOCK)
    return size


def _begins(file: BinaryIO, at: int, size: int, opcode: int, length: int) -> bool:
    end = at + HEAD.size + length
    if end > size:
        return False
    if opcode == Opcode.CHUNK:
        return _is_chunk(read(file, at + HEAD.size, CHUNK.size + 12), length)
    if length < MESSAGE.size:
        return False
    after = read(file, end, HEAD.size)
    if len(after) < HEAD.size:
        return False
    opcode, length = HEAD.unpack(after)
    return 0 < opcode <= max(Opcode) and end + HEAD.size + length <= size
