"""How benchmarks take time."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import psutil

from pipeline.base.machine import gpus
from pipeline.simulator.parameters import Parameters

REPEATS = 3  # the best of them counts: others may use the machine too


def timed(work: Callable[[], object]) -> tuple:
    """What `work` returns, and its CPU and wall time [s]."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    return result, time.process_time() - cpu, time.perf_counter() - wall


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
    """The best of some runs."""
    return min(timed(run)[2] for _ in range(repeats))


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


def available(device: str) -> bool:
    return device in {"cpu", *gpus()}
