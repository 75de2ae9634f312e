"""Stages on a Dask cluster with a shared folder: what stands in for a stage, and its worker.

DVC stays whole on the flow's machine: it removes outputs, hashes, runs the command and writes
dvc.lock. The command alone goes away: where SLING_DASK is set, stages/run.sh starts this module,
which has a worker run stages/run.sh in the same folder and passes lines and exit status on.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any

from pipeline.flow import dvc
from sling2sim2real.base import errors
from sling2sim2real.base.errors import UserError, one_line
from sling2sim2real.base.machine import cores, workers


@contextmanager
def there(dask: str | None, slurm: Path | None) -> Iterator[dict[str, str]]:
    """What in a stage's environment hands it over; nothing without a cluster.

    Args:
        dask: Address of a scheduler.
        slurm: YAML file that says what dask-jobqueue's jobs are; they end with the block.

    Raises:
        UserError: No scheduler answers.
    """
    if slurm and not slurm.is_file():
        raise UserError(f"--slurm {slurm}: no such file; docs/cluster/jobqueue.yaml is one")
    if slurm:
        from dask import config
        from dask_jobqueue.slurm import SLURMCluster

        config.update(config.config, config.collect(paths=[str(slurm)], env={}))
        cluster: Any = SLURMCluster(scheduler_options={"dashboard": False})
        with cluster:
            cluster.adapt()
            yield {"SLING_DASK": cluster.scheduler_address}
    elif dask:
        connected(dask).close()
        yield {"SLING_DASK": dask}
    else:
        yield {}


def connected(address: str) -> Any:
    """A client of the scheduler there. Raises UserError."""
    from distributed import Client

    try:
        return Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(f"no Dask scheduler answers at {address}: {one_line(error)}") from error


def main() -> int:
    """Have a worker run `sh stages/run.sh ARGUMENTS`; its exit status."""
    with connected(os.environ["SLING_DASK"]) as client:
        topic = f"sling-{uuid.uuid4().hex}"
        client.subscribe_topic(topic, lambda event: print(event[1], flush=True))
        order = (Path.cwd(), os.environ["DVC_STAGE"], sys.argv[1:], topic)
        return client.submit(run_here, *order, pure=False).result()


def run_here(folder: Path, stage: str, arguments: list[str], topic: str) -> int:
    """On a worker: run a stage in the shared folder, with this worker's environment.

    With DVC_STAGE, and the worker as SLING_FLOW, the stage ends where the worker does.
    """
    from distributed import get_worker

    worker = get_worker()
    key = worker.get_current_task()
    env = dvc.environment(workers() or max(1, cores() // worker.state.nthreads))
    env["DVC_STAGE"] = stage
    command = ["sh", "stages/run.sh", *arguments]
    process = subprocess.Popen(command, cwd=folder, env=env, **dvc.PIPED)

    def watch() -> None:
        while process.poll() is None:
            if worker.state.tasks[key].state == "cancelled":  # or who asked is gone
                os.killpg(process.pid, signal.SIGTERM)
            time.sleep(1)

    Thread(target=watch, daemon=True).start()
    for line in process.stdout or ():
        worker.log_event(topic, line.rstrip())
    return process.wait()


if __name__ == "__main__":
    errors.run(main)
