"""A command killed at random moments and begun again, until it ends well."""

from __future__ import annotations

import os
import signal
import subprocess
import time

import numpy as np
import psutil

from validation.campaigns.kills.commands import StruckCopy
from validation.projects import PROMPT, MarkedRun, command_line, wait

VICTIMS = ("process", "group", "process", "command")
MEAN = 15.0  # s until a kill, at any moment as likely
ENDED = 1200.0  # s that a command may take without further kills


def chance(copy: StruckCopy, number: int, seed: int) -> np.random.Generator:
    """Random numbers of an attempt, by its number."""
    return np.random.default_rng([seed, number, *copy.name.encode()])


def kind(command: str) -> str:
    """Which part a process plays, by its command line; empty: none that is struck."""
    if "stages." in command and "repro" not in command:
        return f"stage {command.partition('stages.')[2].split()[0]}"
    for word, part in (
        ("guard.py", "guard"),
        ("dask_worker", "Dask's worker"),
        ("dask_scheduler", "Dask's scheduler"),
        ("repro", "DVC"),
        ("spawn_main", "worker of a stage"),
        ("dvc", "DVC"),
    ):
        if word in command:
            return part
    return ""


def strike(
    run: MarkedRun, command: subprocess.Popen, victim: str, rng: np.random.Generator
) -> str | None:
    """Kill at once; what was hit, None if nothing was there any more."""
    if victim == "command":
        command.kill()
        return "the command"
    others = [
        process
        for process in run.alive()
        if process.pid != command.pid and kind(command_line(process))
    ]
    if not others:
        return None
    hit = others[rng.integers(len(others))]
    what = kind(command_line(hit))
    try:
        if victim == "group":
            os.killpg(os.getpgid(hit.pid), signal.SIGKILL)
        else:
            hit.kill()
    except (ProcessLookupError, psutil.NoSuchProcess):
        return None
    return what


def struck(copy: StruckCopy, number: int, most: int, seed: int) -> dict:
    """One attempt: the command, killed `most` times at most, until it has ended.

    Args:
        copy: Where it runs.
        number: Of attempts before, which says with `seed` what chance brings.

    Returns:
        `status`, `kills`, `seconds`, and `faults`: what went otherwise than it must.
    """
    rng = chance(copy, number, seed)
    command, kills, start = copy.start(), [], time.monotonic()
    ended = lambda: command.poll() is not None  # noqa: E731
    while len(kills) < most and not wait(ended, rng.exponential(MEAN)):
        victim = VICTIMS[rng.integers(len(VICTIMS))]
        if hit := strike(copy.run, command, victim, rng):
            after = round(time.monotonic() - start, 1)
            kills.append({"sent_to": victim, "hit": hit, "after_s": after})
    faults = []
    try:
        status = command.wait(ENDED)
    except subprocess.TimeoutExpired:
        command.kill()
        status = command.wait()
        faults.append(f"did not end within {ENDED:g} s")
    if left := copy.left(PROMPT):
        faults.append(f"lives {PROMPT:g} s later: {left}")
    message = copy.run.message
    if "Traceback" in message or (status and not kills):
        faults.append(f"status {status}: {message[-1500:]}")
    return {
        "status": status,
        "kills": kills,
        "seconds": round(time.monotonic() - start, 1),
        "faults": faults,
    }
