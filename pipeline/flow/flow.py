"""`sling flow`: a flow of Prefect's; a task is a stage, submitted when its producers are done.

To be imported when `server.configure` has set the project's settings of Prefect.
"""

from __future__ import annotations

import re
import threading
import time
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import networkx
from prefect import flow, get_run_logger, task
from prefect.artifacts import create_progress_artifact, update_progress_artifact
from prefect.cache_policies import NO_CACHE
from prefect.client.schemas.objects import State
from prefect.states import Completed, Failed
from prefect.task_runners import ThreadPoolTaskRunner

from pipeline.flow import cluster, dvc
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores
from sling2sim2real.base.progress import parse

AWAY = 16  # stages at a time on a cluster: DVC waits here for each
ON_GPU = ("history", "cma", "search", "policy")  # steps that compute where SLING_DEVICE says


def run(
    root: Path, graph: networkx.DiGraph, workers: int | None, dask: str | None, slurm: Path | None
) -> str:
    """Run stages; those that compute on a GPU one at a time, where SLING_DEVICE is CUDA.

    Args:
        root: The working copy.
        graph: As `dvc.stale` gives it.
        workers: Stages at a time; default as many as cores, which they share, or AWAY.
        dask: Address of the scheduler whose workers run the stages.
        slurm: File that says which jobs run them.

    Returns:
        One line: how many stages ended in which of Prefect's states.

    Raises:
        UserError: A stage failed, with that line and what failed; or no cluster answers.
    """
    start, states = time.monotonic(), {}

    @task(cache_policy=NO_CACHE)
    def stage(name: str) -> State:
        with gpu if name.partition("@")[0] in ON_GPU else nullcontext():
            return _repro(root, name, env)

    @flow(name="sling flow")
    def sling_flow(waiting: list[str]) -> State:
        futures, ended = {}, SimpleQueue()
        try:
            while len(states) < len(graph):
                for name in [n for n in waiting if states.keys() >= {*graph.predecessors(n)}]:
                    waiting.remove(name)
                    named: Any = stage.with_options(task_run_name=name)
                    producers = [futures[producer] for producer in graph.predecessors(name)]
                    futures[name] = named.submit(name, wait_for=producers)
                    futures[name].add_done_callback(lambda _, name=name: ended.put(name))
                name = ended.get()
                futures[name].wait()
                states[name] = futures[name].state
                print(f"{name} | {states[name].name}", flush=True)
        except BaseException:
            dvc.end_all()
            raise
        return Failed() if any(state.is_failed() for state in states.values()) else Completed()

    # Who has most to follow comes first, and so producers before consumers.
    order = sorted(graph, key=lambda name: -len(networkx.descendants(graph, name)))
    with cluster.there(dask, slurm) as address:
        workers = workers or (AWAY if address else cores())
        env = dvc.environment(max(1, cores() // workers)) | address
        gpu = threading.Lock() if env.get("SLING_DEVICE", "").startswith("cuda") else nullcontext()
        print(f"{len(graph)} stages, {workers} at a time", flush=True)
        runner: Any = ThreadPoolTaskRunner(max_workers=workers)
        sling_flow.with_options(task_runner=runner)(order, return_state=True)
    counts = Counter(str(state.name) for state in states.values())
    words = ", ".join(f"{count} {name}" for name, count in counts.items())
    failed = [f"; {state.message}" for state in states.values() if state.is_failed()]
    summary = f"stages: {words} ({time.monotonic() - start:.0f} s){''.join(failed)}"
    if failed:
        raise UserError(summary)
    return summary


def _repro(root: Path, name: str, env: dict[str, str]) -> State:
    """Have DVC run a stage: its lines go to Prefect, and how far it is as a progress artifact."""
    logger, bar = get_run_logger(), None

    def on_line(line: str) -> None:
        nonlocal bar
        logger.info("%s", line)
        print(f"{name} | {line}", flush=True)
        if step := parse(line):
            percent = 100 * step.done / step.total
            if bar:
                update_progress_artifact(bar, percent, step.counted)
            else:
                key = re.sub("[^a-z0-9]+", "-", name)
                bar = create_progress_artifact(percent, key, step.counted)

    try:
        dvc.repro(root, name, env, on_line)
    except UserError as error:
        return Failed(message=f"{name}: {error}")
    return Completed()
