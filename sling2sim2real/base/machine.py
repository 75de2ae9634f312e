"""Where simulations run: said by the environment, because results depend on it by rounding alone.

SLING_DEVICE: cpu (default), or a GPU: cuda:0, cuda:1, ...; cuda is the first one.
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


def device() -> str:
    """The device that SLING_DEVICE names. Raises UserError."""
    return named(os.environ.get("SLING_DEVICE") or "cpu", "SLING_DEVICE")


def kind() -> str:
    """cpu or cuda: what results depend on of SLING_DEVICE. Raises UserError."""
    return device().partition(":")[0]


def named(text: str, source: str) -> str:
    """The device that `text` names; `source` says where a user wrote it.

    Raises UserError where it names none, or one that is not there.
    """
    if text == "cpu":
        return text
    if not re.fullmatch("cuda(:(0|[1-9][0-9]*))?", text):
        raise UserError(f"{source} must be cpu, or a GPU such as cuda:0, got {text!r}")
    name, there = "cuda:0" if text == "cuda" else text, gpus()
    if name not in there:
        seen = f"CUDA sees {', '.join(there) or 'no GPU on this machine; take cpu'}"
        raise UserError(f"{source} {text}: {name} is not there; {seen}")
    return name


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
