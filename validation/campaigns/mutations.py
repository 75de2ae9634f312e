"""A small recording, damaged in thousands of seeded ways, each run from file to episode.

    python -m validation.campaigns.mutations FOLDER FIRST COUNT KIND...

prints two lines of JSON a mutation: which it is before it runs, what came of it after. A timer ends
the process where one hangs; the last line then names the culprit.

The episode of a damaged file equals the undamaged one's, or the recording says what it lost. Where
checksums were mended after the damage, or never were, nobody can ask for that; what remains is no
traceback, no hang, no memory over 2 GB.
"""

import faulthandler
import json
import os
import resource
import signal
import struct
import subprocess
import sys
import time
import zlib
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import zstandard
from mcap.writer import CompressionType

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.params import Params, load
from pipeline.recording.build import Processed, episode_of, process
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
ROOT = Path(__file__).parents[2]
HEAD = struct.Struct("<BQ")
CHUNK, MESSAGE = 6, 5
EXTREMES = [0, 1, 2, 255, 2**16, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**63, 2**64 - 1]


def write_small(path: Path, kind: str) -> None:
    """About 100 kB that become an episode in about a tenth of a second."""
    lens = Lens(size=(80, 60), focal=62.5, fps=8)
    write_bag(
        path, TRUTH, rate=200, pose_rate=50, lens=lens, **{"chunk_size": 12_000, **KINDS[kind]}
    )


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


def campaign(folder: Path, tasks: list[tuple], jobs: int) -> list[dict]:
    """Results of all tasks, a process each: first seed, how many of each kind, the kinds.

    Args:
        jobs: Processes at once.
    """
    for kind in KINDS:
        write_small(folder / f"{kind}.mcap", kind)
    with ThreadPoolExecutor(jobs) as pool:
        return [line for part in pool.map(lambda task: _run(folder, *task), tasks) for line in part]


def _run(folder: Path, first: int, count: int, *kinds: str) -> list[dict]:
    command = [sys.executable, "-m", "validation.campaigns.mutations"]
    done = subprocess.run(
        [*command, *map(str, (folder, first, count, *kinds))],
        cwd=ROOT,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    found: dict[tuple[str, int], dict] = {}
    for line in map(json.loads, done.stdout.splitlines()):
        found.setdefault((line["kind"], line["seed"]), {}).update(line)
    if done.returncode:  # the last one hung, crashed or raised
        kind, seed = last = next(reversed(found), (kinds[0], first))
        found.setdefault(last, {"seed": seed, "kind": kind})
        found[last].update(outcome="crashed", words=done.stderr[-3000:], s=HANGS, bytes=0)
    return list(found.values())


def failures(results: list[dict]) -> list[dict]:
    """What may not be."""
    return [
        one
        for one in results
        if one["outcome"] in ("crashed", "unclear")
        or (one["outcome"] == "silent" and one["kind"] in CHECKED)
        or one["bytes"] > MOST
    ]


def counts(results: list[dict]) -> dict[str, dict[str, int]]:
    return {
        kind: dict(
            sorted(Counter(one["outcome"] for one in results if one["kind"] == kind).items())
        )
        for kind in KINDS
    }


def mutated(content: bytes, kind: str, seed: int) -> bytes:
    """A damaged copy."""
    random = np.random.default_rng([seed, *kind.encode()])
    if kind == "garbage":
        return _garbage(content, random)
    ways = [_flip, _bytes, _zeros, _ones, _copy, _cut_out, _insert, _truncate]
    ways += [_swap_records, _again, _without, _field, _field, _opcode]
    return ways[random.integers(len(ways))](content, random)


def records(content: bytes) -> list[tuple[int, int, int]]:
    """(opcode, start, end) of each record of an undamaged file, heads included."""
    at, found = 8, []
    while at < len(content) - 8:
        opcode, length = HEAD.unpack_from(content, at)
        found.append((opcode, at, at + HEAD.size + length))
        at = found[-1][2]
    return found


def _record(content: bytes, random: np.random.Generator, least: int = 1, most: int = 255):
    found = [one for one in records(content) if least <= one[0] <= most]
    return found[random.integers(len(found))][1:]


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


def _zeros(content: bytes, random: np.random.Generator) -> bytes:
    a, b = _span(content, random)
    return content[:a] + bytes(b - a) + content[b:]


def _ones(content: bytes, random: np.random.Generator) -> bytes:
    a, b = _span(content, random)
    return content[:a] + b"\xff" * (b - a) + content[b:]


def _copy(content: bytes, random: np.random.Generator) -> bytes:
    (a, b), at = _span(content, random), _place(content, random)
    return content[:at] + content[a:b] + content[at:]


def _cut_out(content: bytes, random: np.random.Generator) -> bytes:
    a, b = _span(content, random)
    return content[:a] + content[b:]


def _insert(content: bytes, random: np.random.Generator) -> bytes:
    a, b = _span(content, random)
    return content[:a] + random.bytes(b - a) + content[a:]


def _truncate(content: bytes, random: np.random.Generator) -> bytes:
    return content[: _place(content, random)]


def _swap_records(content: bytes, random: np.random.Generator) -> bytes:
    found = [one for one in records(content) if one[0] in (CHUNK, MESSAGE)]
    i, j = sorted(random.choice(len(found), 2, replace=False))
    (_, a, b), (_, c, d) = found[i], found[j]
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
    start, end, _, _, name = struct.unpack_from("<QQQII", content, a + 9)
    data = bytes(8) + zstandard.ZstdDecompressor().decompress(content[a + 9 + 32 + name + 8 : b])
    if random.random() < 0.5:  # one message, and its fields first of all
        x, y = _record(data + bytes(8), random, 1, MESSAGE)
        near = min(y - x, 130 if random.random() < 0.5 else y - x)
        hurt = _hurt(bytes(8) + data[x : x + near], random)
        data = data[:x] + hurt[8:] + data[x + near :]
    else:
        data = _hurt(data, random)
    data = data[8:]
    packed = zstandard.ZstdCompressor().compress(data)
    fields = struct.pack("<QQQII", start, end, len(data), zlib.crc32(data), 4) + b"zstd"
    body = fields + struct.pack("<Q", len(packed)) + packed
    return content[:a] + HEAD.pack(CHUNK, len(body)) + body + content[b:]


def _hurt(content: bytes, random: np.random.Generator) -> bytes:
    ways = [_flip, _bytes, _zeros, _ones, _word]
    return ways[random.integers(len(ways))](content, random)


def _word(content: bytes, random: np.random.Generator) -> bytes:
    at, size = _place(content, random), int(random.choice([1, 2, 4, 8]))
    value = EXTREMES[random.integers(len(EXTREMES))]
    return (content[:at] + _packed(value, size) + content[at + size :])[: len(content)]


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


def main(folder: Path, first: int, count: int, kinds: list[str]) -> None:
    params = small_params()
    for kind in kinds:
        _mutate(folder, kind, range(first, first + count), params)


def _mutate(folder: Path, kind: str, seeds: range, params: Params) -> None:
    original = folder / f"{kind}.mcap"
    content = original.read_bytes()
    done = process(original, params.bands["band1"], params)
    whole, usual = episode_of(done, "band1", params), said(done)
    path = folder / f"{kind}-{seeds.start}-mutated.mcap"
    for seed in seeds:
        path.write_bytes(mutated(content, kind, seed))
        about = {"seed": seed, "kind": kind}
        print(json.dumps(about), flush=True)
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
