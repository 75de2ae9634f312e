"""`sling flow`: a flow of Prefect's; a task is a stage, submitted when its producers are done.

To be imported when `server.configure` has set the project's settings of Prefect.
"""

from __future__ import annotations

import re
import time
from collections import Counter
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import networkx
from prefect import flow, get_run_logger, task
from prefect.artifacts import create_progress_artifact, update_progress_artifact
from prefect.cache_policies import NO_CACHE
from prefect.client.orchestration import get_client
from prefect.client.schemas.actions import GlobalConcurrencyLimitUpdate
from prefect.client.schemas.objects import State
from prefect.states import Completed, Failed
from prefect.task_runners import ThreadPoolTaskRunner

from pipeline.flow import cluster, dvc
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.machine import cores
from sling2sim2real.base.progress import parse


def run(
    root: Path,
    graph: networkx.DiGraph,
    workers: int | None = None,
    gpus: int | None = None,
    dask: str | None = None,
    slurm: Path | None = None,
) -> str:
    """Run stages.

    Args:
        root: The working copy.
        graph: As `dvc.stale` gives it.
        workers: Stages at a time; default as many as cores, which they share, or as `cluster.there`
            says.
        gpus: Stages at a time that compute on a GPU; default 1 where SLING_DEVICE is CUDA.
        dask: Address of the scheduler whose workers run the stages.
        slurm: File that says which jobs run them.

    Returns:
        One line: how many stages ended in which of Prefect's states.

    Raises:
        UserError: A stage failed, with that line and what failed; or no cluster answers.
    """
    start = time.monotonic()
    with cluster.there(dask, slurm) as (address, slots):
        workers = workers or slots or cores()
        env = dvc.environment(max(1, cores() // workers)) | address
        gpus = gpus or (1 if env.get("SLING_DEVICE", "").startswith("cuda") else None)
        if gpus:
            with get_client(sync_client=True) as client:
                client.upsert_global_concurrency_limit_by_name("tag:gpu", gpus)
                free = GlobalConcurrencyLimitUpdate(active_slots=0)  # a killed flow gave none back
                client.update_global_concurrency_limit("tag:gpu", free)
        print(f"{len(graph)} stages, {workers} at a time", flush=True)
        states = _perform(root, graph, env, workers, limited=gpus is not None)
    counts = Counter(str(state.name) for state in states.values())
    words = ", ".join(f"{count} {name}" for name, count in counts.items())
    failed = [f"; {state.message}" for state in states.values() if state.is_failed()]
    summary = f"stages: {words} ({time.monotonic() - start:.0f} s){''.join(failed)}"
    if failed:
        raise UserError(summary)
    return summary


def _perform(
    root: Path, graph: networkx.DiGraph, env: dict[str, str], workers: int, limited: bool
) -> dict[str, State]:
    """Run stages; how each ended: Completed, Cached, Fresh, Failed, or NotReady."""
    runner: Any = ThreadPoolTaskRunner(max_workers=workers)
    states: dict[str, State] = {}

    @task(cache_policy=NO_CACHE)
    def stage(name: str) -> State:
        return _repro(root, name, env)

    @flow(name="sling flow", task_runner=runner)
    def sling_flow(stages: list[str]) -> State:
        waiting, futures, ended = [*stages], {}, SimpleQueue()
        try:
            while len(states) < len(stages):
                for name in [n for n in waiting if states.keys() >= {*graph.predecessors(n)}]:
                    waiting.remove(name)
                    tags = ["gpu"] if limited and graph.nodes[name]["gpu"] else []
                    named: Any = stage.with_options(task_run_name=name, tags=tags)
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
    whole: Any = sling_flow
    whole(order, return_state=True)
    return states


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
        output = "\n".join(dvc.repro(root, name, on_line, ["-s"], env))
    except dvc.StageFailed as error:
        return Failed(message=str(error))
    fresh = "Fresh" if "didn't change, skipping" in output else "Completed"
    return Completed(name="Cached" if "is cached - skipping" in output else fresh)
