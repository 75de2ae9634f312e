"""What a Dask worker does for a flow: run a stage in its own working copy.

What the stage says travels to the head by Dask.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path

from app.cluster import exchange
from app.flow import child
from pipeline.base import machine
from pipeline.base.errors import UserError
from stages import dvc_files


@dataclass(frozen=True)
class Order:
    """A stage as it is sent to a worker.

    Attributes:
        name: The stage.
        token: A file of the head's working copy; who sees it works in the same one.
        sources: Digests of all that the stage reads and no stage makes.
        producers: The stages that made the rest.
        entries: What the head's dvc.lock says of it and them.
    """

    name: str
    token: str
    sources: Mapping[str, str]
    producers: tuple[str, ...]
    entries: Mapping[str, dict]


def working_copy() -> Path:
    """Where this worker works: SLING_COPY, else the folder that it was started in."""
    return Path(os.environ.get("SLING_COPY") or ".").resolve()


def introduce(token: str) -> tuple[bool, dict[str, str]]:
    """Whether this worker works in the head's own working copy, and its versions."""
    return (working_copy() / token).exists(), versions()


def versions() -> dict[str, str]:
    """Versions of Python and of every package that is installed, by name in lower case."""
    installed = {
        distribution.name.lower(): distribution.version
        for distribution in distributions()
        if distribution.name
    }
    return {"python": platform.python_version(), **installed}


def work(order: Order, topic: str) -> tuple[bool, dict | None]:
    """Run a stage; what it says goes out under a topic of Dask's, as [kind, text].

    Kinds are "on" (where it runs), "line", and "end", when all its processes have ended.

    Returns:
        Whether it ran, and its entry of dvc.lock; None where that is in the head's copy already.

    Raises:
        UserError: This copy cannot run it, or files cannot travel.
        StageFailed: As `child.run_stage`.
    """
    from distributed import Reschedule, Status, get_worker

    worker, copy = get_worker(), working_copy()
    key = worker.get_current_task()

    def say(kind: str, text: str = "") -> None:
        worker.log_event(topic, [kind, text])

    def cancelled() -> bool:  # by the head, because the head is gone, or with this worker
        closing = worker.status in (Status.closing, Status.closed, Status.failed)
        return closing or worker.state.tasks[key].state == "cancelled"

    def run() -> bool:
        return child.run_stage(
            copy,
            order.name,
            environment=environment(worker.state.nthreads),
            on_line=lambda line: say("line", line),
            cancelled=cancelled,
        )

    say("on", f"{worker.address} in {copy}")
    try:
        if (copy / order.token).exists():
            return run(), None
        if differs := exchange.differing(copy, order.sources):
            raise UserError(f"{order.name}: refused by worker {worker.address}: {copy}: {differs}")
        exchange.expect_remote(copy)
        dvc_files.mend(copy)
        exchange.merge(copy, order.entries)
        exchange.transfer(copy, "pull", order.producers, cancelled)
        ran = run()
        exchange.transfer(copy, "push", (order.name,), cancelled)
        return ran, exchange.entries(copy, (order.name,))[order.name]
    except child.Cancelled:
        raise Reschedule from None  # if anyone still wants it
    finally:
        say("end")


def environment(threads: int) -> dict[str, str]:
    """Environment of a stage: the worker's own, with an equal share of its cores. Raises UserError.

    Args:
        threads: Stages that the worker runs at a time. SLING_WORKERS, where set, is the share.
    """
    share = machine.workers() or max(1, machine.cores() // threads)
    blas = ("MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")  # Dask sets them for its own threads
    return {key: value for key, value in child.stage_environment(share).items() if key not in blas}
