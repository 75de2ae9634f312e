"""A stage as a child: `dvc repro` of it alone, in a process group that ends with us."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Thread

from app.flow import dvc_process, guard
from app.flow.disk import with_disk
from app.flow.log import RunLog
from pipeline.base.errors import UserError
from pipeline.base.machine import cores
from stages import dvc_files

# How the lines begin that DVC itself says around a stage's own.
DVCS = (
    "Running stage '", "> ", "Updating lock file", "Generating lock file", "Use `dvc push`",
    "To track the changes with git", "\tgit add", "To enable auto staging", "\tdvc config",
    "Data and pipelines are up to date", "Stage '", "WARNING: '", "ERROR: failed to reproduce",
)  # fmt: skip
BEGINS = re.compile("Running stage '(.+)':")


class StageFailed(UserError):
    """A stage failed; the message is its name and its own clear line."""


class Cancelled(Exception):
    """`cancelled` became true: the stage was ended."""


def stage_environment(cores: int) -> dict[str, str]:
    """What a stage gets: all that is exported here, `cores` threads, and this Python first.

    DVC starts stages by $SHELL: a C shell would read its settings, and nologin is none.
    """
    path = [str(Path(sys.executable).parent), *filter(None, [os.environ.get("PATH")])]
    return {
        **os.environ,
        "PATH": os.pathsep.join(path),
        "SHELL": "/bin/sh",
        "PYTHONUNBUFFERED": "1",  # its lines as they come
        "SLING_WORKERS": str(cores),
        "OMP_NUM_THREADS": str(cores),
    }


def run_stage(
    root: Path,
    name: str,
    *,
    environment: Mapping[str, str],
    on_line: Callable[[str], None],
    cancelled: Callable[[], bool] = lambda: False,
) -> bool:
    """Let DVC run one stage, whose producers are done; wait until it has ended.

    Args:
        root: The working copy.
        name: As DVC calls it.
        environment: The whole environment of the stage.
        on_line: Called with each line of the stage, without its end, as it comes; DVC's are kept
            back.
        cancelled: Asked several times a second; once true, the stage and all its processes end.

    Returns:
        Whether the stage ran; False where DVC found it fresh, or had its outputs in its cache.

    Raises:
        StageFailed: With the stage's clear line.
        Cancelled: All its processes have ended.
    """
    status, output = dvc(
        root,
        ("repro", "-s", name),
        environment=environment,
        on_line=on_line,
        cancelled=cancelled,
    )
    if status == 0:
        return any(line == f"Running stage '{name}':" for line in output)
    raise StageFailed(with_disk(f"{name}: {reason(name, output, status)}", root))


def repro(
    root: Path,
    stage: str,
    on_line: Callable[[str], None],
    on_stage: Callable[[str], None] = lambda name: None,
    *,
    command: str = "dvc repro",
    producers: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Let DVC run a stage and what it needs, as far as it is stale, on all cores.

    What a killed DVC has left is cleared up before and after.

    Args:
        on_line, on_stage: As `dvc` has them.
        command: Whose run this is, for its log.
        producers: By stage, those whose outputs it reads, for the log too.

    Raises:
        StageFailed: With the name of the stage that failed and its clear line.
    """
    running: list[str] = []

    def begins(name: str) -> None:
        if running:
            log.ended(running[-1], "ran")
        running.append(name)
        log.begins(name, (producers or {}).get(name, ()))
        on_stage(name)

    def line(text: str) -> None:
        if running:
            log.line(running[-1], text)
        on_line(text)

    environment = stage_environment(cores())
    dvc_files.mend(root)
    with RunLog(root, command, [stage]) as log:
        try:
            status, output = dvc(
                root, ("repro", stage), environment=environment, on_line=line, on_stage=begins
            )
        except BaseException:
            if running:
                log.ended(running[-1], "cancelled", "interrupted")
            raise
        finally:
            dvc_files.mend(root)
        last = running[-1] if running else stage
        failed = with_disk(f"{last}: {reason(last, output, status)}", root) if status else ""
        if running:
            log.ended(last, "failed" if failed else "ran", failed)
        if failed:
            raise StageFailed(failed)


def dvc(
    root: Path,
    arguments: Sequence[str],
    *,
    environment: Mapping[str, str],
    on_line: Callable[[str], None] = lambda line: None,
    on_stage: Callable[[str], None] = lambda name: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> tuple[int, list[str]]:
    """A DVC command in `root`, which waits for DVC's lock; see `run_stage`.

    Args:
        on_stage: Called with the name of each stage as it begins to run.

    Returns:
        Its exit status, and all lines that it said.

    Raises:
        Cancelled: All its processes have ended.
    """
    command = [sys.executable, "-P", dvc_process.__file__, "--wait-for-lock", *arguments]
    output: list[str] = []
    if cancelled():
        raise Cancelled
    with _guarded(command, root, environment, cancelled) as process:
        for line in process.stdout or ():
            line = line.rstrip("\n")
            output.append(line)
            ending = cancelled() or (process.poll() or 0) < 0  # what an interrupt makes it say
            if begun := BEGINS.fullmatch(line):
                on_stage(begun[1])
            elif not ending and _is_own(line):
                on_line(line)
    if process.returncode and cancelled():
        raise Cancelled
    return process.returncode, output


@contextmanager
def _guarded(
    command: list[str], root: Path, environment: Mapping[str, str], cancelled: Callable[[], bool]
) -> Iterator[subprocess.Popen]:
    """The command behind its guard, with its lines on stdout; nothing of it is left afterwards."""
    process = guard.start(
        command,
        cwd=root,
        env=dict(environment),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        errors="replace",
        close_fds=False,  # the flow's lock is held until its stages have ended, see run.py
    )
    group, ended = 0, Event()

    def watch() -> None:
        while not (ended.wait(0.1) or cancelled() or process.poll() is not None):
            pass
        with suppress(OSError):
            if process.stdin:
                process.stdin.close()
        if process.poll() is not None and group:
            guard.end_group(group)  # nobody is left in it, but where the guard itself was killed

    watcher = Thread(target=watch, daemon=True)
    watcher.start()
    try:
        for line in process.stdout or ():  # the loader's own come first, such as on LD_PRELOAD
            if line.strip().isdecimal():
                group = int(line)
                break
        yield process
    finally:
        ended.set()
        watcher.join()  # the guard's stdin is closed now
        guard.end(process, lambda: group)


def _is_own(line: str) -> bool:
    """Whether a line is a stage's own, and not DVC's."""
    return bool(line) and not line.startswith(DVCS)


def reason(name: str, output: list[str], status: int) -> str:
    """Why a stage failed: its own line of error, else what DVC says, else its last line."""
    if signal := _signal(status):  # whatever the stage said of that; DVC's comes by the guard
        return f"{'its guard' if status < 0 else 'DVC'} was killed by signal {signal}"
    messages = [line for line in output if _is_own(line)]
    for line, following in zip(output, [*output[1:], ""], strict=True):
        why = line.removeprefix(f"ERROR: failed to reproduce '{name}': ")
        if why.startswith("failed to run: "):  # ..., exited with 1
            status = int(why.rpartition(" ")[2])
        elif why != line:  # DVC failed before or after the stage's command
            messages.append(f"{why} {following.strip()}" if why.endswith(":") else why)
    errors = [line[7:] for line in messages if line.lower().startswith("error: ")]
    if errors:
        return errors[-1]
    if signal := _signal(status):
        return f"was killed by signal {signal}"
    return messages[-1] if messages else f"ended with exit status {status}"


def _signal(status: int) -> int:
    """The signal that ended a process: 9 of -9, as Python has it, and of 137, as a shell; else 0.

    A stage's comes as either: some shells stay around it, others become it.
    """
    return abs(status) % 128 if status < 0 or 128 < status < 192 else 0
