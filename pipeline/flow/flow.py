"""The flow of Prefect's: a task a stage, submitted when its producers are done.

`run` has imported this after it has set the project's settings of Prefect.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
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

from pipeline.base.progress import parse
from pipeline.flow import dvc

GPU = "gpu"  # tag of tasks that compute on a GPU


def perform(
    root: Path,
    graph: networkx.DiGraph,
    env: Mapping[str, str],
    workers: int,
    gpus: int | None,
) -> dict[str, State]:
    """Run stages; how each ended: Completed, Cached, Fresh, Failed, or NotReady.

    Args:
        root: The working copy.
        graph: As `dvc.stale` gives it.
        env: Environment of each stage.
        workers: Stages at a time.
        gpus: Stages at a time that compute on a GPU; None: no limit.
    """
    states: dict[str, State] = {}

    @task(cache_policy=NO_CACHE)
    def stage(name: str) -> State:
        of_gpu = {"SLING_ON_GPU": "1"} if graph.nodes[name]["gpu"] else {}
        return _repro(root, name, {**env, **of_gpu})

    runner: Any = ThreadPoolTaskRunner(max_workers=workers)  # its type does not fit Prefect's own

    @flow(name="sling flow", task_runner=runner)
    def sling_flow(stages: list[str]) -> State:
        waiting, futures, ended = [*stages], {}, SimpleQueue()
        try:
            while len(states) < len(stages):
                for name in [n for n in waiting if states.keys() >= {*graph.predecessors(n)}]:
                    waiting.remove(name)
                    tags = [GPU] if gpus and graph.nodes[name]["gpu"] else []
                    named: Any = stage.with_options(task_run_name=name, tags=tags)
                    producers = [futures[producer] for producer in graph.predecessors(name)]
                    futures[name] = named.submit(name, wait_for=producers)
                    futures[name].add_done_callback(lambda _, name=name: ended.put(name))
                name = ended.get()
                futures[name].wait()
                states[name] = futures[name].state
                print(f"{name} | {states[name].name}", flush=True)
        except BaseException:
            dvc.end()
            raise
        failed = [name for name in stages if states[name].is_failed()]
        return Failed(message=f"failed: {', '.join(failed)}") if failed else Completed()

    if gpus:
        with get_client(sync_client=True) as client:
            client.upsert_global_concurrency_limit_by_name(f"tag:{GPU}", gpus)
            free = GlobalConcurrencyLimitUpdate(active_slots=0)  # a killed flow gave none back
            client.update_global_concurrency_limit(f"tag:{GPU}", free)
    # Who has most to follow comes first, and so producers before consumers.
    order = sorted(graph, key=lambda name: -len(networkx.descendants(graph, name)))
    sling_flow(order, return_state=True)  # pyright: ignore[reportCallIssue]
    return states


def _repro(root: Path, name: str, env: Mapping[str, str]) -> State:
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
        output = dvc.repro(root, name, on_line, ["-s"], env)
    except dvc.StageFailed as error:
        return Failed(message=str(error))
    for words, state in ("is cached - skipping", "Cached"), ("didn't change, skipping", "Fresh"):
        if any(words in line for line in output):
            return Completed(name=state)
    return Completed()
