"""Where simulations run: said by the environment, because results depend on it by rounding alone.

SLING_DEVICE: cpu (default), cuda (all GPUs; CUDA_VISIBLE_DEVICES hides some), one such as cuda:0,
or several such as cuda:0,cuda:2. Several share every batch; how many they are changes no result.
SLING_WORKERS: threads on the CPU (default: all cores that this process may use).
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sling2sim2real.base.errors import UserError

LIMIT = Path("/sys/fs/cgroup/cpu.max")


def devices() -> tuple[str, ...]:
    """Devices that SLING_DEVICE names, each by its own name. Raises UserError."""
    return named(os.environ.get("SLING_DEVICE") or "cpu", "SLING_DEVICE")


def kind() -> str:
    """cpu or cuda: what results depend on of SLING_DEVICE. Raises UserError."""
    return devices()[0].partition(":")[0]


def named(text: str, source: str) -> tuple[str, ...]:
    """The devices that `text` names; `source` says where a user wrote it.

    Raises UserError where it names none, or one twice, or one that is not there.
    """
    names = tuple(text.split(","))
    if names == ("cpu",):
        return names
    if names != ("cuda",) and not all(re.fullmatch("cuda:(0|[1-9][0-9]*)", name) for name in names):
        raise UserError(
            f"{source} must be cpu, cuda (all GPUs), cuda:0, or several such as cuda:0,cuda:2,"
            f" got {text!r}"
        )
    if len(set(names)) < len(names):
        raise UserError(f"{source} {text}: names a GPU twice")
    there = gpus()
    if not there:
        raise UserError(f"{source} {text}: CUDA sees no GPU on this machine; take cpu")
    names = there if names == ("cuda",) else names
    missing = ", ".join(name for name in names if name not in there)
    if missing:
        raise UserError(f"{source} {text}: {missing} is not there; CUDA sees {', '.join(there)}")
    return names


def gpus() -> tuple[str, ...]:
    """Names of the GPUs that CUDA sees, cuda:0 first."""
    from sling2sim2real.base.native import start, wp

    start()
    return tuple(str(device) for device in wp.get_cuda_devices())


def workers() -> int | None:
    """SLING_WORKERS; None is all cores. Raises UserError."""
    text = os.environ.get("SLING_WORKERS")
    if not text:
        return None
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise UserError(f"SLING_WORKERS must be a whole number above 0, got {text!r}")
    return int(text)


def cores() -> int:
    """How many threads or processes may be kept busy here. Raises UserError.

    SLING_WORKERS; else the cores that this process may run on, as far as its container's limit of
    CPU time allows.
    """
    if message := workers():
        return message
    ours = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        time, period = map(int, LIMIT.read_text().split())  # "max 100000" where there is none
    except (OSError, ValueError):
        return ours or 1
    return min(ours or 1, -(-time // period))


def processor() -> str:
    """The processor's name where Linux tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def commit(folder: Path) -> str | None:
    """What Git calls the working copy that `folder` lies in; None where that is not known."""
    command = ["git", "describe", "--always", "--dirty"]
    try:
        git = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except OSError:
        return None
    return git.stdout.strip() or None


@contextmanager
def one_thread() -> Iterator[None]:
    """Torch without threads: how many there are would change in which order it sums."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
