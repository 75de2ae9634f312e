"""How benchmarks take time, and what a command takes: time, memory, disk."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage

import numpy as np
import psutil

from sling2sim2real.simulator.parameters import Parameters

EVERY = 1.0  # s between two looks at the memory
REPEATS = 3  # the best of them counts: others may use the machine too


def busy() -> float:
    """Seconds that this machine's cores have worked, for whomever."""
    spent = psutil.cpu_times()
    return spent.user + spent.nice + spent.system


def others_share(before: float, cpu: float, wall: float) -> float:
    """Share of the cores that other programs took since `busy()` was `before`.

    Args:
        cpu, wall: What we took since then [s].
    """
    available = wall * (os.cpu_count() or 1)
    return round(max(0.0, busy() - before - cpu) / available, 3)


def seconds(run: Callable[[], object], repeats: int = REPEATS) -> float:
    """Wall time of the best of some runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def shared(devices: Sequence[str], simulate: Callable, parameters: Parameters, **options) -> list:
    """What `simulate` gives for each device's share of N parameters, all at once."""
    shares = np.array_split(np.arange(len(parameters)), len(devices))
    with ThreadPoolExecutor(len(devices)) as pool:
        return list(
            pool.map(
                lambda device, share: simulate(parameters[share], device=device, **options),
                devices,
                shares,
            )
        )


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
            words,
            cwd=cwd,
            env=surroundings,
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
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
