"""Damaged recordings of every family and in every container, each run from file to episode.

    python -m validation.campaigns.mutations --count 20000 --workers 2

writes reports/validation/mutations.json. A run that was killed goes on where it was.

The episode of a damaged recording equals the undamaged one's, or the recording says what it lost,
or it is refused in one clear line. Where checksums were mended after the damage, or never were,
nobody can ask for the first; what remains is no traceback, no hang, no memory over 2 GiB.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

from pipeline.base import errors
from pipeline.base.code import ROOT, digests
from pipeline.base.errors import UserError
from pipeline.base.files import replacing
from pipeline.base.fingerprint import fingerprint
from validation.campaigns import outcomes, runner
from validation.campaigns.outcomes import FAULT, HANGS, MOST, name_of
from validation.campaigns.runner import Result, ResultLines
from validation.recordings.small import CHECKED, CONTAINERS, FAMILIES, write_small
from validation.reports import write_report

WORK, REPORT = Path("build/mutations"), Path("reports/validation/mutations.json")
LIBRARIES = ("mcap", "mcap-ros2-support", "mcap-protobuf-support", "rosbags", "protobuf")
LIBRARIES += ("foxglove-sdk", "zstandard", "lz4", "opencv-python-headless")
SHARE = 250  # recordings a process: what one process held is known a share at a time
RELEASE_ERROR = 500


def key(result: Result) -> tuple[str, str, int]:
    return result["family"], result["container"], result["seed"]


def shares(count: int, done: set[tuple]) -> list[tuple[str, str, int, int]]:
    """Family, container, first seed and the one behind the last, of what is not done.

    Every family is in every container as often, or once more. Low seeds come first, so that a run
    that is stopped has some of each.
    """
    cells = [(family, container) for family in FAMILIES for container in CONTAINERS]
    parts = []
    for place, cell in enumerate(cells):
        last = (count - place + len(cells) - 1) // len(cells)
        todo = [seed for seed in range(last) if (*cell, seed) not in done]
        while todo:
            end = next((n for n, seed in enumerate(todo) if seed != todo[0] + n), len(todo))
            end = min(end, SHARE)
            parts.append((*cell, todo[0], todo[0] + end))
            todo = todo[end:]
    return sorted(parts, key=lambda part: part[2] // SHARE)


def run(
    folder: Path,
    parts: list[tuple],
    workers: int,
    on_result: Callable[[Result], None],
    end: float = math.inf,
) -> None:
    """Run shares, each in a process of its own, and tell of each recording.

    Args:
        folder: Where recordings are written.
        parts: Of `shares`.
        workers: Processes at once.
        on_result: Called with each result, in threads.
        end: When to stop, of time.monotonic() [s].
    """
    for family, container in {part[:2]: None for part in parts}:
        original = folder / f"{name_of(family, container)}.mcap"
        if not original.exists():
            with replacing(original) as temporary:
                write_small(temporary, family, container)

    def work(part: tuple) -> None:
        for result in _results(folder, *part) if time.monotonic() < end else ():
            on_result(result)
            if time.monotonic() > end:
                break

    with ThreadPoolExecutor(workers) as pool:
        for _ in pool.map(work, parts):
            pass


def _results(folder: Path, family: str, container: str, first: int, end: int) -> Iterator[Result]:
    """Results of one share; the recording next when a process ends too early is a fault."""
    module, log = "validation.campaigns.outcomes", folder / f"{family}-{container}-{first}.log"
    while first < end:
        command = [sys.executable, "-m", module, folder, family, container, first, end]
        line: Result = {}
        with log.open("w") as message:
            process = subprocess.Popen(
                list(map(str, command)),
                cwd=ROOT,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
                stdout=subprocess.PIPE,
                stderr=message,
                text=True,
            )
            try:
                for line in map(json.loads, process.stdout):
                    if "outcome" in line:
                        yield line
                        first = line["seed"] + 1
            except GeneratorExit:  # the time is over
                process.kill()
                process.wait()
                raise
        if process.wait() and first < end:
            if not line:
                raise RuntimeError(f"{' '.join(map(str, command))}: {log.read_text()}")
            when = " before it began" if "outcome" in line else ""
            words = f"ended by {process.returncode}{when}{_place(log.read_text())}"
            recording = {"family": family, "container": container, "seed": first}
            yield {**recording, "outcome": FAULT, "words": words, "s": HANGS, "bytes": 0}
            first += 1
    log.unlink(missing_ok=True)


def _place(log: str) -> str:
    """Where a process was when it ended: what faulthandler wrote has the last call first."""
    calls = [line.strip() for line in log.splitlines() if line.strip().startswith("File ")]
    return f", {calls[0]}" if calls else ""


def faults(results: list[Result]) -> list[Result]:
    """What may not be."""
    return [result for result in results if result["outcome"] == FAULT]


def counts(results: list[Result]) -> dict[str, dict[str, dict[str, int]]]:
    """How many there were of each outcome, by family and container."""
    counters = {family: {container: Counter() for container in CONTAINERS} for family in FAMILIES}
    for result in results:
        counters[result["family"]][result["container"]][result["outcome"]] += 1
    return {
        family: {name: dict(sorted(some.items())) for name, some in row.items()}
        for family, row in counters.items()
    }


def summary(results: list[Result], wanted: int) -> dict:
    """Summarise results in the order of their keys."""
    failed = faults(results)
    slowest = max(results, key=lambda result: result["s"])
    largest = max(results, key=lambda result: result["bytes"])
    return {
        "asked": "Of every damaged recording comes the undamaged one's episode, or an episode and"
        " what was lost, or one clear line; no traceback, no hang,"
        f" at most {MOST / 2**30:g} GiB. Another episode, of which nothing is said, only where"
        " the container has no checksums, or where they were mended after the damage.",
        "met": not failed and len(results) >= wanted,
        "settings": {
            "wanted": wanted,
            "hang_cpu_s": HANGS,
            "without_checksums": sorted(set(CONTAINERS) - set(CHECKED)),
            "versions": {name: version(name) for name in LIBRARIES},
        },
        "figures": {
            "recordings": len(results),
            "outcomes": dict(Counter(result["outcome"] for result in results)),
            "by_family_and_container": counts(results),
            "longest": {**_named(slowest), "cpu_s": slowest["s"]},
            "most_memory": {**_named(largest), "mib": largest["bytes"] / 2**20},
            "faults": failed,
        },
    }


def _named(result: Result) -> Result:
    return {name: result[name] for name in ("family", "container", "seed")}


def main() -> None:
    parser = runner.parser(__doc__, REPORT, WORK)
    parser.add_argument("--count", type=int, default=20_000, help="recordings (default: 20000)")
    args = parser.parse_args()
    if min(args.count, args.workers) < 1:
        raise UserError("--count, --workers: from 1 on")
    code = fingerprint(json.dumps(digests(Path(outcomes.__file__))))[:12]
    lines = ResultLines(args.work / code / "results.jsonl")
    parts = shares(args.count, {key(line) for line in lines.lines})
    start, before = time.monotonic(), len(lines.lines)
    print(f"{before} recordings are done, {sum(b - a for *_, a, b in parts)} are to do", flush=True)

    def on_result(result: Result) -> None:
        lines.add(result)
        if result["outcome"] == FAULT:
            print(json.dumps(result), flush=True)
        if len(lines.lines) % RELEASE_ERROR == 0:
            minutes = (time.monotonic() - start) / 60
            failed = len(faults([*lines.lines]))
            print(f"{len(lines.lines)}, {minutes:.1f} min: {failed} faults", flush=True)

    if not args.report_only:
        run(lines.path.parent, parts, args.workers, on_result, start + 60 * args.minutes)
    results = sorted(runner.expect(lines.lines, args.work), key=key)
    arguments = f"--count {args.count} --workers {args.workers}"
    write_report(args.report, summary(results, args.count), arguments)
    print(f"{args.report}: {len(results)} recordings, {len(faults(results))} faults", flush=True)


if __name__ == "__main__":
    errors.run(main)
