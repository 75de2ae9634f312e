"""A small recording, damaged in thousands of seeded ways, each run from file to episode.

    python -m tests.recording.input.mutations FOLDER FIRST COUNT KIND...

prints two lines of JSON a mutation: its recipe before it runs, what came of it after. A timer ends
the process where one hangs; the last line then names the culprit.
"""

from __future__ import annotations

import faulthandler
import io
import json
import resource
import signal
import struct
import sys
import time
import zlib
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.params import Params, load
from pipeline.recording.build import Processed, episode_of, process
from pipeline.recording.input import decode
from tests.recording.bag import Lens, Truth, write_bag

KINDS = {
    "zstd": {"compression": CompressionType.ZSTD},
    "lz4": {"compression": CompressionType.LZ4},
    "plain": {"compression": CompressionType.NONE},
    "unchunked": {"use_chunking": False, "enable_data_crcs": True},
    "unchecked": {"use_chunking": False},
    "garbage": {"compression": CompressionType.ZSTD},  # inside of chunks, checksums mended
}
CHECKED = ("zstd", "lz4", "plain", "unchunked")  # damage must be noticed
HANGS = 10.0  # s of the processor, which others may share
BLOCKS = 120.0  # s on the clock
MOST = 2 * 2**30  # bytes
TRUTH = Truth(grasp=0.4, lifted=0.6, drawn=1.1, release=1.6003, end=2.2, radius=0.012)
HEAD = struct.Struct("<BQ")
CHUNK, MESSAGE = 6, 5
EXTREMES = [0, 1, 2, 255, 2**16, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1]


def write_small(path: Path, kind: str) -> None:
    """About 100 kB that become an episode in about a tenth of a second."""
    lens, options = Lens(size=(80, 60), focal=62.5, fps=8), KINDS[kind]
    chunked = options.get("use_chunking", True)
    options = {"chunk_size": 12_000, **options} if chunked else {}
    write_bag(path, TRUTH, rate=200, pose_rate=50, lens=lens, **options)
    if not chunked:
        rewrite(path, KINDS[kind])


def rewrite(path: Path, options: dict[str, object]) -> None:
    """The same messages with other options of the container's writer."""
    content = io.BytesIO(path.read_bytes())
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start("ros2")
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in make_reader(content).iter_messages(log_time_order=False):
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(
                    channel.topic, channel.message_encoding, schemas[schema.id]
                )
            writer.add_message(
                channels[channel.id], message.log_time, message.data, message.publish_time
            )
        writer.finish()


def small_params() -> Params:
    """The project's, for a window, pictures and a band as small as the recording's."""
    whole = load("params.yaml")
    episode = {"duration": 2.0, "samples": 50, "tail": 0.3}
    cloud = {"points": 50, "statistical_neighbors": 5, "radius": 0.05, "radius_neighbors": 2}
    band = whole.bands["band1"].model_copy(update={"diameter": 2 * TRUTH.radius})
    sections = {
        "episode": whole.episode.model_copy(update=episode),
        "cloud": whole.cloud.model_copy(update=cloud),
        "bands": {"band1": band},
    }
    return whole.model_copy(update=sections)


def mutated(content: bytes, kind: str, seed: int) -> tuple[bytes, str]:
    """A damaged copy, and its recipe in words."""
    random = np.random.default_rng([seed, *kind.encode()])
    if kind == "garbage":
        return _garbage(content, random)
    ways = [_flip, _bytes, _zeros, _ones, _copy, _cut_out, _insert, _truncate]
    ways += [_swap_records, _again, _without, _field, _field, _opcode]
    way = ways[random.integers(len(ways))]
    return way(content, random)


def records(content: bytes) -> list[tuple[int, int, int]]:
    """(opcode, start, end) of each record of an undamaged file, heads included."""
    at, found = 8, []
    while at < len(content) - 8:
        opcode, length = HEAD.unpack_from(content, at)
        found.append((opcode, at, at + HEAD.size + length))
        at = found[-1][2]
    return found


def _place(content: bytes, random: np.random.Generator) -> int:
    return int(random.integers(8, len(content)))


def _span(content: bytes, random: np.random.Generator) -> tuple[int, int]:
    start = _place(content, random)
    return start, min(len(content), start + int(np.exp(random.uniform(0, np.log(30_000)))))


def _flip(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    data, bits = bytearray(content), []
    for _ in range(random.integers(1, 4)):
        at, bit = _place(content, random), int(random.integers(8))
        data[at] ^= 1 << bit
        bits.append(f"{at}.{bit}")
    return bytes(data), f"bits {' '.join(bits)} flipped"


def _bytes(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    data, places = bytearray(content), []
    for _ in range(random.integers(1, 9)):
        at = _place(content, random)
        data[at] = int(random.integers(256))
        places.append(f"{at}={data[at]}")
    return bytes(data), f"bytes {' '.join(places)}"


def _zeros(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    a, b = _span(content, random)
    return content[:a] + bytes(b - a) + content[b:], f"{a}:{b} zero"


def _ones(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    a, b = _span(content, random)
    return content[:a] + b"\xff" * (b - a) + content[b:], f"{a}:{b} ones"


def _copy(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    (a, b), at = _span(content, random), _place(content, random)
    return content[:at] + content[a:b] + content[at:], f"{a}:{b} again at {at}"


def _cut_out(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    a, b = _span(content, random)
    return content[:a] + content[b:], f"{a}:{b} cut out"


def _insert(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    a, b = _span(content, random)
    return content[:a] + random.bytes(b - a) + content[a:], f"{b - a} bytes put in at {a}"


def _truncate(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    at = _place(content, random)
    return content[:at], f"cut off at {at}"


def _swap_records(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    found = [one for one in records(content) if one[0] in (CHUNK, MESSAGE)]
    i, j = sorted(random.choice(len(found), 2, replace=False))
    (_, a, b), (_, c, d) = found[i], found[j]
    data = content[:a] + content[c:d] + content[b:c] + content[a:b] + content[d:]
    return data, f"records {a}:{b} and {c}:{d} swapped"


def _again(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    found = records(content)
    _, a, b = found[random.integers(len(found))]
    at = found[random.integers(len(found))][1]
    return content[:at] + content[a:b] + content[at:], f"record {a}:{b} again at {at}"


def _without(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    found = records(content)
    _, a, b = found[random.integers(len(found))]
    return content[:a] + content[b:], f"record {a}:{b} left out"


def _field(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    """A number at the head of a record, where lengths, counts, times and checksums are."""
    found = records(content)
    _, a, b = found[random.integers(len(found))]
    size = int(random.choice([2, 4, 8]))
    at = a + 1 if random.random() < 0.3 else int(random.integers(a, min(b, a + 60)))
    if random.random() < 0.5:
        value = EXTREMES[random.integers(len(EXTREMES))]
    else:
        old = int.from_bytes(content[at : at + size], "little")
        value = max(0, old + int(random.integers(-300, 300)))
    data = bytearray(content)
    data[at : at + size] = (value % 2 ** (8 * size)).to_bytes(size, "little")
    return bytes(data), f"{size} bytes at {at} set to {value}"


def _opcode(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    found = records(content)
    _, a, _ = found[random.integers(len(found))]
    data = bytearray(content)
    data[a] = int(random.integers(256))
    return bytes(data), f"opcode at {a} is {data[a]}"


def _garbage(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    """The records of one chunk damaged and its checksum mended: what reads messages must cope."""
    chunks = [one for one in records(content) if one[0] == CHUNK]
    _, a, b = chunks[random.integers(len(chunks))]
    start, end, _, _, name = struct.unpack_from("<QQQII", content, a + 9)
    data = zstandard.ZstdDecompressor().decompress(content[a + 9 + 32 + name + 8 : b])
    if random.random() < 0.5:  # one message, and its fields first of all
        inner = [one for one in records(bytes(8) + data + bytes(8)) if one[0] <= MESSAGE]
        _, x, y = inner[random.integers(len(inner))]
        head = bytes(8) + data[x - 8 : y - 8]
        near = 8 + min(len(head) - 8, 130 if random.random() < 0.5 else len(head))
        part, recipe = _hurt(head[:near], random)
        data = data[: x - 8] + part[8:] + head[near:] + data[y - 8 :]
        recipe = f"in record {x - 8}: {recipe}"
    else:
        part, recipe = _hurt(bytes(8) + data, random)
        data = part[8:]
    packed = zstandard.ZstdCompressor().compress(data)
    if name == 3:
        packed = lz4.frame.compress(data)
    fields = struct.pack("<QQQII", start, end, len(data), zlib.crc32(data), 4) + b"zstd"
    body = fields + struct.pack("<Q", len(packed)) + packed
    whole = content[:a] + HEAD.pack(CHUNK, len(body)) + body + content[b:]
    return whole, f"chunk at {a}, mended: {recipe}"


def _hurt(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    ways = [_flip, _bytes, _zeros, _ones, _word]
    return ways[random.integers(len(ways))](content, random)


def _word(content: bytes, random: np.random.Generator) -> tuple[bytes, str]:
    at, size = _place(content, random), int(random.choice([1, 2, 4, 8]))
    value = EXTREMES[random.integers(len(EXTREMES))] % 2 ** (8 * size)
    data = bytearray(content)
    data[at : at + size] = value.to_bytes(size, "little")
    return bytes(data[: len(content)]), f"{size} bytes at {at} set to {value}"


def same(a: Episode, b: Episode) -> bool:
    """Whether two episodes hold the same numbers."""
    names = ("time", "position", "velocity", "force", "opening", "cloud_time", "camera")
    if any(not np.array_equal(getattr(a, n), getattr(b, n), equal_nan=True) for n in names):
        return False
    events = [(e.grasp_time, e.release_time, len(e.clouds)) for e in (a, b)]
    clouds = zip(a.clouds, b.clouds, strict=False)
    return events[0] == events[1] and all(np.array_equal(x, y) for x, y in clouds)


def outcome(path: Path, params: Params, whole: Episode, usual: list[str]) -> tuple[str, str]:
    """refused, same, said or silent; and the words beside the usual ones."""
    try:
        done = process(path, params.bands["band1"], params)
        episode = episode_of(done, "band1", params)
    except UserError as error:
        line = str(error)
        is_line = "\n" not in line and str(path) in line and len(line) < 2000
        return ("refused" if is_line else "unclear"), line
    words = [one for one in said(done) if one not in usual]
    if words:
        return "said", "; ".join(words)
    return ("same" if same(episode, whole) else "silent"), ""


def said(done: Processed) -> list[str]:
    """Everything by which a user is told of damage."""
    words = [*done.recording.losses, *done.recording.notes]
    if done.clouds.damaged or done.clouds.unpaired:
        words.append(f"{done.clouds.damaged} pictures damaged, {done.clouds.unpaired} unpaired")
    return words


def _compile_once() -> None:
    """Schemas that are not damaged are the same in every run, and slow to compile."""
    compiled, build = {}, decode._store

    def store(channel):
        schema = channel.schema
        key = (schema.name, schema.encoding, schema.data)
        if key not in compiled:
            compiled[key] = build(channel)
        return compiled[key]

    decode._store = store


def main(folder: Path, first: int, count: int, kinds: list[str]) -> None:
    params = small_params()
    _compile_once()
    for kind in kinds:
        _mutate(folder, kind, range(first, first + count), params)


def _mutate(folder: Path, kind: str, seeds: range, params: Params) -> None:
    original = folder / f"{kind}.mcap"
    content = original.read_bytes()
    done = process(original, params.bands["band1"], params)
    whole, usual = episode_of(done, "band1", params), said(done)
    path = folder / f"{kind}-{seeds.start}-mutated.mcap"
    for seed in seeds:
        data, recipe = mutated(content, kind, seed)
        path.write_bytes(data)
        about = {"seed": seed, "kind": kind}
        print(json.dumps({**about, "recipe": recipe}), flush=True)
        signal.setitimer(signal.ITIMER_PROF, HANGS)
        faulthandler.dump_traceback_later(BLOCKS, exit=True)
        start = time.process_time()
        came, words = outcome(path, params, whole, usual)
        seconds = time.process_time() - start
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0)
        bytes_held = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        line = {**about, "outcome": came, "words": words, "s": seconds, "bytes": bytes_held}
        print(json.dumps(line), flush=True)
    path.unlink(missing_ok=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:])
