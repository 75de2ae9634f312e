"""Stages on a Dask cluster: `sling flow --cluster tcp://scheduler:8786`.

The flow stays on the head; a thread for each stage sends it to a Dask worker and waits.
A worker runs it in its working copy, the folder that it was started in or SLING_COPY:

- the head's own, in a shared folder: nothing travels;
- another one: what the stage reads comes by the DVC remote, and what it makes goes back the same
  way, with its entry of dvc.lock. A copy with other code or parameters is refused.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from app.cluster import exchange
from app.cluster.worker import Order, introduce, versions, work
from app.flow import child
from app.flow.graph import Stage, stages_of
from pipeline.base.errors import UserError

ANSWER = 10.0  # seconds that a scheduler has to answer
END = 20.0  # seconds that a cancelled stage has to end its processes
LOOK = 5.0  # seconds between looks at which workers are there
TOKEN = ".checkpoints/cluster-"
GPU = "GPU"  # Dask's resource, as in `dask worker --resources GPU=1`


class Cluster:
    """A Dask cluster that runs stages for the working copy `root`, the head; a context manager.

    Attributes:
        slots: Stages that the flow may hand over at a time. They wait in Dask's queue: workers may
            come and go.

    Raises:
        UserError: The extra is not installed, or nothing answers at `address` within ten seconds.
    """

    slots = 64

    def __init__(self, root: Path, address: str) -> None:
        self.root, self.address = root, address
        self.client = connect(address)
        self._stages: dict[str, Stage] = {}
        self._shares: dict[str, bool] = {}  # whether a worker works in the head's copy, by address
        self._sent: set[str] = set()  # stages whose outputs the remote has
        self._lock = threading.Lock()
        self.token = f"{TOKEN}{uuid.uuid4().hex}"

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        (self.root / self.token).unlink(missing_ok=True)
        self.client.close()

    def run_stage(
        self,
        root: Path,
        name: str,
        *,
        environment: Mapping[str, str],
        on_line: Callable[[str], None],
        cancelled: Callable[[], bool] = lambda: False,
    ) -> bool:
        """`child.run_stage` on a worker; all that the stage made is here when it returns.

        Args:
            root: The head's working copy.
            name: The stage.
            environment: Of a stage that runs on the head; a worker's stage has the worker's own.
            on_line: Called in the caller's thread with each line that the stage prints.
            cancelled: Asked several times a second.

        Returns:
            Whether the stage ran.

        Raises:
            UserError: A worker refused it, files cannot travel, its workers died.
            StageFailed, Cancelled: As `child.run_stage`.
        """
        with self._lock:
            if not self._stages:
                self._stages = stages_of(root)
                self._begin()
        stage = self._stages[name]
        if not stage.travels:
            on_line("runs on the head: what it makes is Git's, not DVC's")
            return child.run_stage(
                root, name, environment=environment, on_line=on_line, cancelled=cancelled
            )
        workers = self._some(on_line, cancelled)
        if not all(self._shares[address] for address in workers):
            exchange.expect_remote(root)
            self._send(stage.producers, cancelled)
        resources: dict[str, float] = {}
        if stage.gpu and any(worker["resources"].get(GPU) for worker in workers.values()):
            resources = {GPU: 1}
        elif stage.gpu:
            on_line(f"no worker offers {GPU} (dask worker --resources {GPU}=1): runs on any")
        order = Order(
            name,
            self.token,
            exchange.digests(root, (*exchange.ALWAYS, *stage.sources)),
            stage.producers,
            exchange.entries(root, (name, *stage.producers)),
        )
        ran, entry = self._result(order, resources, on_line, cancelled)
        if entry:
            exchange.merge(root, {name: entry})
            exchange.transfer(root, "pull", (name,), cancelled)
            with self._lock:
                self._sent.add(name)
        return ran

    def _begin(self) -> None:
        """Leave the token, by which workers know the head's folder; those of killed flows go."""
        token = self.root / self.token
        token.parent.mkdir(exist_ok=True)
        for old in self.root.glob(f"{TOKEN}*"):
            old.unlink()
        token.touch()

    def _some(
        self, on_line: Callable[[str], None], cancelled: Callable[[], bool]
    ) -> dict[str, dict]:
        """The workers, once there are some. Raises UserError, Cancelled."""
        announced = False
        while not (workers := self._meet(on_line)):
            if cancelled():
                raise child.Cancelled
            if not announced:
                on_line(waits({}, "", {}))
            announced = True
            time.sleep(0.5)
        return workers

    def _meet(self, on_line: Callable[[str], None]) -> dict[str, dict]:
        """The workers that are there, by address; new ones introduce themselves. UserError."""
        with self._lock:
            workers = self._workers()
            new = [address for address in workers if address not in self._shares]
            if not new:
                return workers
            answers: Any = self.client.run(introduce, self.token, workers=new, on_error="return")
            ours = versions()
            for address, answer in answers.items():
                if isinstance(answer, ImportError):
                    raise UserError(
                        f"worker {address}: {answer}; start it with the Python of a working copy's"
                        " .venv, which knows the project"
                    )
                if isinstance(answer, BaseException):  # gone again
                    continue
                self._shares[address], theirs = answer
                if differ := differences(ours, theirs):
                    on_line(f"warning: worker {address} has {differ}")
            return {address: workers[address] for address in workers if address in self._shares}

    def _workers(self) -> dict[str, dict]:
        try:
            return dict(self.client.scheduler_info(n_workers=-1)["workers"])
        except OSError as error:
            raise self._gone() from error

    def _gone(self) -> UserError:
        return UserError(f"the Dask scheduler at {self.address} is gone")

    def _send(self, producers: tuple[str, ...], cancelled: Callable[[], bool]) -> None:
        """Push what the remote may lack of what these stages made. Raises as `transfer`."""
        with self._lock:
            new = tuple(producer for producer in producers if producer not in self._sent)
            exchange.transfer(self.root, "push", new, cancelled)
            self._sent.update(new)

    def _result(
        self,
        order: Order,
        resources: dict[str, float],
        on_line: Callable[[str], None],
        cancelled: Callable[[], bool],
    ) -> tuple[bool, dict | None]:
        """What `work` returns on a worker that has these resources; passes its lines on."""
        from concurrent.futures import CancelledError

        from distributed import KilledWorker

        with self._listening() as (topic, messages):
            future = self.client.submit(
                work,
                order,
                topic,
                key=f"{order.name.partition('@')[0]}-{uuid.uuid4().hex}",  # Dask counts by step
                resources=resources,
                pure=False,
            )
            on, announced, looked = "", "", time.monotonic()
            while True:
                done = future.done()  # asked first: what was said before it is there by then
                for kind, text in drained(messages, 0.0 if done else 0.2):
                    on = text if kind == "on" else on
                    if kind != "end":
                        on_line(f"on {text}" if kind == "on" else text)
                if done:
                    break
                if cancelled():
                    future.cancel()
                    if on:  # wait until its processes have ended
                        deadline = time.monotonic() + END
                        while time.monotonic() < deadline:
                            if any(kind == "end" for kind, _ in drained(messages, 0.2)):
                                break
                    raise child.Cancelled
                if time.monotonic() - looked > LOOK:
                    looked = time.monotonic()
                    tell = waits(self._workers(), on.split(" ")[0], resources)
                    if tell and tell != announced:
                        on_line(tell)
                    announced = tell
            try:
                return future.result()
            except KilledWorker as error:
                raise UserError(
                    f"{order.name}: the worker died under it {error.allowed_failures + 1} times,"
                    f" last {error.last_worker.address}; its log says why"
                ) from error
            except CancelledError as error:
                raise self._gone() from error

    @contextmanager
    def _listening(self) -> Iterator[tuple[str, queue.SimpleQueue]]:
        """A topic of Dask's for what one stage says, and the queue in which that arrives."""
        topic, messages = f"sling-{uuid.uuid4().hex}", queue.SimpleQueue()
        self.client.subscribe_topic(topic, lambda event: messages.put(event[1]))
        try:
            yield topic, messages
        finally:
            self.client.unsubscribe_topic(topic)


def connect(address: str):
    """A client of the scheduler there. Raises UserError."""
    try:
        from distributed import Client
    except ImportError as error:
        raise UserError(
            "--cluster: Dask is not installed: .venv/bin/pip install -e '.[cluster]'"
            " -c constraints.txt"
        ) from error
    for name in ("distributed", "distributed.client"):  # a scheduler that is gone is one line
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UserError(
            f"--cluster: no Dask scheduler answers at {address} ({str(error).splitlines()[0]});"
            " `dask scheduler` starts one and says its address"
        ) from error


def drained(messages: queue.SimpleQueue, patience: float) -> Iterator[tuple[str, str]]:
    """What is in a queue, waiting for the first [s]."""
    try:
        yield tuple(messages.get(timeout=patience) if patience else messages.get_nowait())
        while True:
            yield tuple(messages.get_nowait())
    except queue.Empty:
        return


def waits(workers: Mapping[str, dict], on: str, resources: Mapping[str, float]) -> str:
    """What a stage waits for, in words; empty while it runs `on` a worker that is there."""
    if on in workers:
        return ""
    if on:
        return f"worker {on} is gone: the stage begins anew on another"
    fit = [worker for worker in workers.values() if not resources or worker["resources"].get(GPU)]
    return f"waits for a {'free ' if fit else ''}worker{f' with {GPU}' if resources else ''}"


def differences(ours: Mapping[str, str], theirs: Mapping[str, str], most: int = 6) -> str:
    """Versions that differ, of what both have, in words."""
    differ = [
        f"{name} {theirs[name]} (here {ours[name]})"
        for name in ("python", *sorted(theirs.keys() - {"python"}))
        if ours.get(name, theirs[name]) != theirs[name]
    ]
    more = f" and {len(differ) - most} more" if len(differ) > most else ""
    return ", ".join(differ[:most]) + more
