"""`sling flow`: what is stale, as a flow of Prefect's, on this machine or on a Dask cluster."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from pipeline.base.disk import expect_ready
from pipeline.base.errors import UserError
from pipeline.base.machine import cores
from pipeline.flow import cluster, dvc, server

OUTCOMES = {  # by Prefect's state
    "Completed": "ran",
    "Cached": "taken from the cache",
    "Fresh": "fresh after all",
    "NotReady": "not run",
}


def run(
    root: Path,
    targets: Sequence[str] = (),
    workers: int | None = None,
    gpus: int | None = None,
    dask: str | None = None,
    slurm: Path | None = None,
) -> str:
    """Run what is stale and what follows from it. Sets Prefect's environment for this process.

    Args:
        root: The working copy, with dvc.yaml.
        targets: Stages or steps; these alone with what leads to them.
        workers: Stages at a time; default as many as cores, which they share, or as `cluster.there`
            says.
        gpus: Stages at a time that compute on a GPU; default 1 where SLING_DEVICE is CUDA.
        dask: Address of the scheduler whose workers run the stages.
        slurm: File that says which jobs run them.

    Returns:
        One line: how many stages ran.

    Raises:
        UserError: A stage failed, with counts and what failed; or why nothing could run.
    """
    start = time.monotonic()
    if not ((root / ".dvc").is_dir() and (root / "dvc.yaml").is_file()):
        raise UserError(f"{root}: no dvc.yaml and .dvc/ here; run it in the project's folder")
    expect_ready(root)
    graph = dvc.stale(root, targets)
    if not graph:
        return "nothing is stale"
    with cluster.there(dask, slurm) as (address, slots):
        workers = workers or slots or cores()
        env = dvc.environment(max(1, cores() // workers)) | address
        if env.get("SLING_DEVICE", "").startswith("cuda") and not address:
            gpus = gpus or 1
        settings = server.environment(root)  # of Prefect, which is not imported yet
        os.environ.clear()
        os.environ.update(settings)
        from pipeline.flow.flow import perform

        print(f"{len(graph)} stages, {workers} at a time", file=sys.stderr)
        states = perform(root, graph, env, workers, gpus)
    counts = Counter(OUTCOMES.get(state.name or "", "failed") for state in states.values())
    words = ", ".join(f"{count} {what}" for what, count in counts.items())
    summary = f"stages: {words} ({time.monotonic() - start:.0f} s)"
    failed = [state.message or name for name, state in states.items() if state.is_failed()]
    if failed:
        raise UserError("; ".join([summary, *failed]))
    return summary
