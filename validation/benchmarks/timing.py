"""How benchmarks take time, and what their figures belong to."""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import numpy as np

import pipeline.simulator
from pipeline.base.fingerprint import fingerprint
from pipeline.base.machine import commit, gpus, named, processor
from validation.code import digests

REPEATS = 3  # the best of them counts: others may use the machine too
SIMULATOR = fingerprint(Path(pipeline.simulator.__file__).parent)[:12]  # as it is imported


def timed(work: Callable[[], object]) -> tuple:
    """What `work` returns, and its CPU and wall time [s]."""
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    return result, time.process_time() - cpu, time.perf_counter() - wall


def seconds(run: Callable[[], object], repeats: int = REPEATS) -> float:
    """The best of some runs."""
    return min(timed(run)[2] for _ in range(repeats))


def shared(devices: Sequence[str], simulate: Callable, thetas: np.ndarray, **options) -> list:
    """What `simulate` gives for each device's share of thetas (N, 5), all at once."""
    with ThreadPoolExecutor(len(devices)) as pool:
        return list(
            pool.map(
                lambda device, share: simulate(share, device=device, **options),
                devices,
                np.array_split(thetas, len(devices)),
            )
        )


def available(device: str) -> bool:
    return device in {"cpu", *gpus()}


def environment(device: str, command: str = "", *scripts: Path) -> dict:
    """What a figure belongs to: device, its name, command, versions, commit and code.

    `code` has a digest of each folder that `scripts` import, by default the file that calls this;
    it tells also where there is no git. `simulator` is that of pipeline/simulator.
    """
    import warp as wp

    scripts = scripts or (Path(sys._getframe(1).f_code.co_filename),)
    devices, name = named(device, "--device"), processor()
    if device != "cpu":
        name = wp.get_device(devices[0]).name
    packages = ("warp-lang", "numpy", "scipy")
    return {
        "device": device,
        "device_name": name,
        "devices": len(devices),
        "cores": os.cpu_count(),
        "command": command or f"sling bench --device {device} --json",
        "commit": commit(Path(__file__).parent),
        "simulator": SIMULATOR,
        "code": digests(*scripts),
        "versions": {"python": platform.python_version()}
        | {package: version(package) for package in packages},
    }
