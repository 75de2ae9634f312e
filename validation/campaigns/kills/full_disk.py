"""A small disk that is full from a random moment on, until the command has ended.

The disk is a tmpfs, which only root may mount.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.base.errors import UserError, one_line
from validation.campaigns.kills.commands import StruckCopy
from validation.campaigns.kills.strike import chance
from validation.projects import PROMPT, wait

SIZE = 300  # MB
ROOM = 100_000  # bytes at most that stay free
MEAN = 20.0  # s from the command's begin until the disk is full
ENDED = 300.0  # s in which a command must notice
SAYS = ("No space left on device", "disk is full", "disk full")


@contextmanager
def small_disk(folder: Path) -> Iterator[None]:
    """Mount it in `folder`. Raises UserError where that is not allowed."""
    folder.mkdir(parents=True, exist_ok=True)
    if os.path.ismount(folder):
        subprocess.run(["umount", "--lazy", folder], check=True)
    words = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}m", "tmpfs", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise UserError(f"--full-disks: no small disk can be mounted: {one_line(done.stderr)}")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def fill(ballast: Path, free: int) -> None:
    """Leave so many bytes free at most, whoever else writes meanwhile."""
    with ballast.open("ab") as file:
        while (more := shutil.disk_usage(ballast.parent).free - free) > 4096:
            try:
                os.posix_fallocate(file.fileno(), file.seek(0, os.SEEK_END), more)
            except OSError:  # somebody was faster
                continue


def filled(copy: StruckCopy, number: int, seed: int, full: bool) -> dict:
    """One attempt: the command, whose disk becomes full at some moment; there is room afterwards.

    Args:
        copy: Where it runs.
        number: Of attempts before, which says with `seed` what chance brings.
        full: Whether the disk becomes full at all.

    Returns:
        `status`, `seconds`, `full_after_s` (None: the command had ended before), `free_bytes`,
        `message` (the line that says so), and `faults`.
    """
    rng = chance(copy, number, seed)
    ballast, free = copy.disk / "ballast", int(rng.integers(0, ROOM))
    command, start, since = copy.start(), time.monotonic(), None
    ended = lambda: command.poll() is not None  # noqa: E731
    faults = []
    if full and not wait(ended, rng.exponential(MEAN)):
        since = round(time.monotonic() - start, 1)
        fill(ballast, free)
        while not wait(ended, 0.2):
            fill(ballast, free)  # again: a stage removes what it is to make anew
            if time.monotonic() - start > ENDED:
                command.kill()
                faults.append(f"did not end within {ENDED:g} s")
    status = command.wait()
    seconds = round(time.monotonic() - start, 1)
    if left := copy.left(PROMPT):
        faults.append(f"lives {PROMPT:g} s later: {left}")
    ballast.unlink(missing_ok=True)
    message = copy.run.message
    lines = [line for line in message.splitlines() if any(what in line for what in SAYS)]
    if status and (since is None or not lines or "Traceback" in message):
        faults.append(f"status {status}: {message[-1500:]}")
    return {
        "status": status,
        "seconds": seconds,
        "full_after_s": since,
        "free_bytes": free,
        "said": lines[-1] if lines else None,
        "faults": faults,
    }
