"""What a command takes: time, memory of its processes, and what it leaves on the disk."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import psutil

from validation.benchmarks.timing import busy, others_share

EVERY = 1.0  # s between two looks at the memory


def measured(
    words: Sequence[str], cwd: Path, surroundings: dict, log: Path, every: float = EVERY
) -> dict:
    """Run a command, with its output in `log`: its status, times [s] and peak memory [byte].

    Memory is that of the command and of all that descends from it, a page that several share
    counted once (PSS), looked at every so often [s].
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    before, ours = getrusage(RUSAGE_CHILDREN), busy()
    start, peak, seen = time.perf_counter(), 0, []
    with log.open("wb") as file:
        process = psutil.Popen(
            words, cwd=cwd, env=surroundings, stdin=subprocess.DEVNULL, stdout=file,
            stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
        status = None
        try:
            while status is None:
                seen = _family(process, seen)
                peak = max(peak, sum(map(_memory, seen)))
                with suppress(psutil.TimeoutExpired):
                    status = process.wait(every)
        except BaseException:
            os.killpg(process.pid, signal.SIGINT)
            raise
    seconds, after = time.perf_counter() - start, getrusage(RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "status": status,
        "seconds": round(seconds, 1),
        "cpu_seconds": round(cpu, 1),
        "peak_memory_bytes": peak,
        "others_share": others_share(ours, cpu, seconds),
    }


def _family(process: psutil.Process, seen: Iterable[psutil.Process]) -> list[psutil.Process]:
    """A process and its descendants, with those whose parents have ended since."""
    processes: dict[int, psutil.Process] = {}
    for ancestor in (process, *seen):
        if ancestor.pid in processes:
            continue
        try:
            processes |= {each.pid: each for each in (ancestor, *ancestor.children(recursive=True))}
        except psutil.NoSuchProcess:
            continue
    return [*processes.values()]


def _memory(process: psutil.Process) -> int:
    try:
        return process.memory_full_info().pss
    except (psutil.NoSuchProcess, psutil.AccessDenied):
        return 0


def disk(path: Path) -> int:
    """Bytes on the disk of a file or folder, of a file with several names once."""
    sizes = {}
    for entry in [path, *path.rglob("*")] if path.exists() else []:
        status = entry.lstat()
        sizes[status.st_dev, status.st_ino] = 512 * status.st_blocks
    return sum(sizes.values())
