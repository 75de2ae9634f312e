"""`sling flow`: the stale stages, each when its producers are done, N at a time."""

from __future__ import annotations

import fcntl
import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from app.flow import child, guard, server
from app.flow.disk import expect_ready
from app.flow.graph import Graph
from app.flow.log import RunLog
from app.flow.scheduler import Scheduler, width
from app.flow.tasks import Place, Tasks, lasted, perform, say
from pipeline.base import machine
from pipeline.base.errors import UserError
from stages import dvc_files


def run(
    root: Path,
    *,
    workers: int | None = None,
    gpus: int | None = None,
    place: Place = child.run_stage,
) -> str:
    """Run what is stale and what follows from it.

    Args:
        root: The working copy, with dvc.yaml.
        workers: Stages at a time, among which the cores of `machine.cores` are shared out where
            they run here; default as many as there are cores, at most as many as can run at once.
        gpus: Stages with `gpu` at a time, among which SLING_DEVICE is shared out; default 1 where
            that is CUDA, else no limit.
        place: Runs one stage somewhere, called and answering as `child.run_stage`.

    Returns:
        One line: how many stages ran.

    Raises:
        UserError: The line of the first stage that failed, or why nothing could run.
        KeyboardInterrupt: After all children have ended.
    """
    start, here = time.monotonic(), place is child.run_stage
    with alone(root):
        dvc_files.mend(root)
        graph = Graph(root)
        stale = [graph.stages[name] for name in graph.stale()]
        if not stale:
            return f"all {len(graph.stages)} stages are fresh ({lasted(start)})"
        cores = machine.cores()
        workers = workers or min(cores, width(stale))
        environment = child.stage_environment(max(1, cores // workers) if here else cores)
        shares = gpu_shares(environment, gpus, here)
        scheduler = Scheduler(stale, workers, shares)
        say(
            f"{len(stale)} of {len(graph.stages)} stages are stale or follow from such;"
            f" {workers} at a time"
        )
        if where := server.address(root):
            say(f"seen at {where}")
        with RunLog(root, "sling flow", [stage.name for stage in stale]) as log, terminable():
            tasks = Tasks(root, graph, environment, place, log)
            try:
                perform(scheduler, tasks)
            finally:
                log.message = scheduler.summary()
                dvc_files.mend(root)  # what next comes may be a `dvc` of the user's
            summary = f"{scheduler.summary()} ({lasted(start)})"
            if scheduler.failed:
                say(summary)
                raise next(iter(scheduler.failed.values()))
    return summary


@contextmanager
def terminable() -> Iterator[None]:
    """SIGTERM interrupts as Ctrl-C does."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def gpu_shares(
    environment: Mapping[str, str], gpus: int | None, here: bool = True
) -> list[dict[str, str]] | None:
    """What each of `gpus` GPU stages gets of SLING_DEVICE; None where nothing limits them.

    Args:
        environment: Of all stages.
        gpus: As in `run`.
        here: Whether they run on this machine; elsewhere its devices say nothing.
    """
    cuda = environment.get("SLING_DEVICE", "").startswith("cuda")
    if gpus is None:
        return [{}] if cuda else None
    if gpus == 1 or not (cuda and here):
        return [{} for _ in range(gpus)]
    names = machine.devices()
    return [
        {"SLING_DEVICE": ",".join(names[n::gpus]) or names[n % len(names)]} for n in range(gpus)
    ]


@contextmanager
def alone(root: Path) -> Iterator[None]:
    """One flow at a time in a working copy: its lock is held until its last child has ended.

    The children's guards inherit the open file, so it outlives a flow that is killed.
    """
    folder = root / ".dvc"
    if not (folder.is_dir() and (root / "dvc.yaml").is_file()):
        raise UserError(f"{root}: no dvc.yaml and .dvc/ here; run it in the project's folder")
    expect_ready(root)
    (folder / "tmp").mkdir(exist_ok=True)
    with (folder / "tmp" / "flow.lock").open("w") as file:
        deadline = time.monotonic() + guard.GRACE + 4
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise UserError(
                        "another `sling flow` is at work in this folder; wait for its end, or"
                        " interrupt it"
                    ) from None
                time.sleep(0.2)
        os.set_inheritable(file.fileno(), True)
        yield
