"""Stages on a Dask cluster with a shared folder: what stands in for a stage, and its worker.

DVC stays whole on the flow's machine: it removes outputs, hashes, runs the command and writes
dvc.lock. The command alone goes away: where SLING_DASK is set, stages/run.sh starts this module,
which has a worker run stages/run.sh in the same folder and passes lines and exit status on.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import Any

from pipeline.base import errors
from pipeline.base.errors import UserError, one_line
from pipeline.base.machine import cores

ANSWER, GRACE = 10.0, 8.0  # s that a scheduler has to answer, and a stage to end
SLOTS = 16  # stages at a time, each of which has DVC wait here


@contextmanager
def there(dask: str | None, slurm: Path | None) -> Iterator[tuple[dict[str, str], int | None]]:
    """What in a stage's environment hands it over, and how many stages at a time; or nothing.

    Args:
        dask: Address of a scheduler.
        slurm: YAML file that says what dask-jobqueue's jobs are; they end with the block.

    Raises:
        UserError: No scheduler answers.
    """
    if slurm:
        from dask import config
        from dask_jobqueue.slurm import SLURMCluster

        config.update(config.config, config.collect(paths=[str(slurm)], env={}))
        jobs: Any = SLURMCluster(scheduler_options={"dashboard": False})
        with jobs as cluster:
            cluster.adapt()
            yield {"SLING_DASK": cluster.scheduler_address}, SLOTS
    elif dask:
        connected(dask).close()
        yield {"SLING_DASK": dask}, SLOTS
    else:
        yield {}, None


def connected(address: str) -> Any:
    """A client of the scheduler there. Raises UserError."""
    from distributed import Client

    for name in ("distributed", "distributed.client"):  # a scheduler that is gone is one line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(f"no Dask scheduler answers at {address}: {one_line(error)}") from error


def main() -> int:
    """Have a worker run `sh stages/run.sh ARGUMENTS`; its exit status."""
    with connected(os.environ["SLING_DASK"]) as client:
        workers = client.scheduler_info(n_workers=-1)["workers"].values()
        with_gpu = [worker for worker in workers if worker["resources"].get("GPU")]
        topic = f"sling-{uuid.uuid4().hex}"
        client.subscribe_topic(topic, lambda event: print(event[1], flush=True))
        of_dvc = {name: os.environ[name] for name in ("DVC_STAGE", "DVC_ROOT")}
        return client.submit(
            run_here, Path.cwd(), sys.argv[1:], of_dvc, topic,
            resources={"GPU": 1} if with_gpu and os.environ.get("SLING_ON_GPU") else {}, pure=False,
        ).result()  # fmt: skip


def run_here(folder: Path, arguments: list[str], of_dvc: dict[str, str], topic: str) -> int:
    """On a worker: run a stage in the shared folder, with this worker's environment."""
    from distributed import Reschedule, Status, get_worker

    worker = get_worker()
    key = worker.get_current_task()
    share = os.environ.get("SLING_WORKERS") or str(max(1, cores() // worker.state.nthreads))
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    process = subprocess.Popen(
        ["sh", "stages/run.sh", *arguments],
        cwd=folder,
        # DVC_STAGE has a stage end with its parent, here with the worker.
        env=os.environ | {"PATH": path, "SLING_WORKERS": share, "OMP_NUM_THREADS": share} | of_dvc,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        start_new_session=True,
    )

    def unwanted() -> bool:  # because who asked is gone, or this worker is going
        going = worker.status in (Status.closing, Status.closed, Status.failed)
        return going or worker.state.tasks[key].state == "cancelled"

    def watch() -> None:
        while process.poll() is None:
            if unwanted():
                os.killpg(process.pid, signal.SIGINT)
                time.sleep(GRACE)
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
            time.sleep(0.3)

    Thread(target=watch, daemon=True).start()
    for line in process.stdout or ():
        worker.log_event(topic, line.rstrip())
    status = process.wait()
    if unwanted():
        raise Reschedule  # if anyone still wants it
    return status


if __name__ == "__main__":
    errors.run(main)
