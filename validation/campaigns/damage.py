"""Damage of every kind done to a recording, the same for the same seed.

Bits, bytes and spans of the file; its records moved, repeated and removed; numbers and kinds at
their heads; and what is inside of chunks, with the checksums mended.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable

import numpy as np
import zstandard
from mcap.opcode import Opcode

from pipeline.recording.input.records import CHUNK as CHUNK_FIELDS
from pipeline.recording.input.records import HEAD

Damage = Callable[[bytes, np.random.Generator], bytes]
CHUNK, MESSAGE = Opcode.CHUNK, Opcode.MESSAGE
EXTREMES = [0, 1, 2, 255, 2**16, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1]


def mutated(content: bytes, name: str, seed: int) -> bytes:
    """A damaged copy; of recordings called "garbage" only the inside of chunks is damaged."""
    random = np.random.default_rng([seed, *name.encode()])
    if name.endswith("garbage"):
        return _garbage(content, random)
    ways = [_flip, _bytes, _zeros, _ones, _copy, _cut_out, _insert, _truncate]
    ways += [_swap_records, _again, _without, _field, _field, _opcode]
    return ways[random.integers(len(ways))](content, random)


def records(content: bytes) -> list[tuple[int, int, int]]:
    """(opcode, start, end) of each record of an undamaged file, heads included."""
    at, spans = 8, []
    while at < len(content) - 8:
        opcode, length = HEAD.unpack_from(content, at)
        spans.append((opcode, at, at + HEAD.size + length))
        at = spans[-1][2]
    return spans


def _record(content: bytes, random: np.random.Generator, least: int = 1, most: int = 255):
    spans = [record for record in records(content) if least <= record[0] <= most]
    return spans[random.integers(len(spans))][1:]


def _place(content: bytes, random: np.random.Generator) -> int:
    return int(random.integers(8, len(content)))


def _span(content: bytes, random: np.random.Generator) -> tuple[int, int]:
    start = _place(content, random)
    return start, min(len(content), start + int(np.exp(random.uniform(0, np.log(30_000)))))


def _flip(content: bytes, random: np.random.Generator) -> bytes:
    data = bytearray(content)
    for _ in range(random.integers(1, 4)):
        data[_place(content, random)] ^= 1 << int(random.integers(8))
    return bytes(data)


def _bytes(content: bytes, random: np.random.Generator) -> bytes:
    data = bytearray(content)
    for _ in range(random.integers(1, 9)):
        at = _place(content, random)
        data[at] = int(random.integers(256))
    return bytes(data)


def _span_to(change: Callable[[bytes, np.random.Generator], bytes]) -> Damage:
    """Put something in the place of a span."""

    def damage(content: bytes, random: np.random.Generator) -> bytes:
        a, b = _span(content, random)
        return content[:a] + change(content[a:b], random) + content[b:]

    return damage


_zeros = _span_to(lambda span, _: bytes(len(span)))
_ones = _span_to(lambda span, _: b"\xff" * len(span))
_cut_out = _span_to(lambda *_: b"")
_insert = _span_to(lambda span, random: random.bytes(len(span)) + span)


def _copy(content: bytes, random: np.random.Generator) -> bytes:
    (a, b), at = _span(content, random), _place(content, random)
    return content[:at] + content[a:b] + content[at:]


def _truncate(content: bytes, random: np.random.Generator) -> bytes:
    return content[: _place(content, random)]


def _swap_records(content: bytes, random: np.random.Generator) -> bytes:
    spans = [record for record in records(content) if record[0] in (CHUNK, MESSAGE)]
    i, j = sorted(random.choice(len(spans), 2, replace=False))
    (_, a, b), (_, c, d) = spans[i], spans[j]
    return content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]


def _again(content: bytes, random: np.random.Generator) -> bytes:
    (a, b), (at, _) = _record(content, random), _record(content, random)
    return content[:at] + content[a:b] + content[at:]


def _without(content: bytes, random: np.random.Generator) -> bytes:
    a, b = _record(content, random)
    return content[:a] + content[b:]


def _field(content: bytes, random: np.random.Generator) -> bytes:
    """A number at the head of a record, where lengths, counts, times and checksums are."""
    a, b = _record(content, random)
    size = int(random.choice([2, 4, 8]))
    at = a + 1 if random.random() < 0.3 else int(random.integers(a, min(b, a + 60)))
    if random.random() < 0.5:
        value = EXTREMES[random.integers(len(EXTREMES))]
    else:
        old = int.from_bytes(content[at : at + size], "little")
        value = max(0, old + int(random.integers(-300, 300)))
    return content[:at] + _packed(value, size) + content[at + size :]


def _packed(value: int, size: int) -> bytes:
    return (value % 2 ** (8 * size)).to_bytes(size, "little")


def _opcode(content: bytes, random: np.random.Generator) -> bytes:
    a, _ = _record(content, random)
    return content[:a] + bytes([random.integers(256)]) + content[a + 1 :]


def _garbage(content: bytes, random: np.random.Generator) -> bytes:
    """The records of one chunk damaged and its checksum mended: what reads messages must cope."""
    a, b = _record(content, random, CHUNK, CHUNK)
    start, end, _, _, name = CHUNK_FIELDS.unpack_from(content, a + HEAD.size)
    data = bytes(8) + zstandard.ZstdDecompressor().decompress(
        content[a + HEAD.size + CHUNK_FIELDS.size + name + 8 : b]
    )
    if random.random() < 0.5:  # one message, and its fields first of all
        x, y = _record(data + bytes(8), random, 1, MESSAGE)
        near = min(y - x, 130 if random.random() < 0.5 else y - x)
        hurt = _hurt(bytes(8) + data[x : x + near], random)
        data = data[:x] + hurt[8:] + data[x + near :]
    else:
        data = _hurt(data, random)
    data = data[8:]
    packed = zstandard.ZstdCompressor().compress(data)
    fields = CHUNK_FIELDS.pack(start, end, len(data), zlib.crc32(data), 4) + b"zstd"
    body = fields + struct.pack("<Q", len(packed)) + packed
    return content[:a] + HEAD.pack(CHUNK, len(body)) + body + content[b:]


def _hurt(content: bytes, random: np.random.Generator) -> bytes:
    ways = [_flip, _bytes, _zeros, _ones, _word]
    return ways[random.integers(len(ways))](content, random)


def _word(content: bytes, random: np.random.Generator) -> bytes:
    at, size = _place(content, random), int(random.choice([1, 2, 4, 8]))
    value = EXTREMES[random.integers(len(EXTREMES))]
    return (content[:at] + _packed(value, size) + content[at + size :])[: len(content)]
