"""The flow as Prefect has it: a task a stage, in a thread that waits for the stage's child."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from threading import Event

from app.flow import child, guard, reporter
from app.flow.disk import expect_room
from app.flow.graph import Graph, Stage
from app.flow.scheduler import Scheduler
from pipeline.base.errors import UserError, one_line

GPU_LIMIT = "sling-gpu"  # a Prefect concurrency limit
SLOT = 20.0  # s that it may take to give a slot
Place = Callable[..., bool]


@dataclass
class Tasks:
    """What happens in the task of a stage, in a thread of its own."""

    root: Path
    graph: Graph
    environment: Mapping[str, str]
    place: Place
    limited: bool
    cancelled: Event = field(default_factory=Event)
    interrupted: bool = False

    def __call__(self, stage: Stage, share: Mapping[str, str]) -> bool:
        """Whether the stage ran; False if it is fresh. Raises StageFailed, Cancelled."""
        if self.graph.is_fresh(stage.name):
            say("is fresh", stage)
            return False
        show, start = reporter.Reporter(stage, self.root), time.monotonic()

        def on_line(line: str) -> None:
            say(line, stage)
            show(line)

        with self._slot(stage):
            say("begins", stage)
            ran = self.place(
                self.root,
                stage.name,
                environment={**self.environment, **share},
                on_line=on_line,
                cancelled=self.cancelled.is_set,
            )
        say(f"{'done' if ran else 'taken from the cache'} ({lasted(start)})", stage)
        if ran:
            show.done()
        return ran

    @contextmanager
    def _slot(self, stage: Stage) -> Iterator[None]:
        """A slot of the limit of GPU stages; Prefect's trouble with it stops no stage."""
        if not (self.limited and stage.gpu):
            yield
            return
        from prefect.concurrency.sync import concurrency

        slot = ExitStack()
        with _noted():  # the scheduler keeps the limit within this flow anyway
            slot.enter_context(
                concurrency(
                    GPU_LIMIT,
                    strict=True,
                    timeout_seconds=SLOT,  # deaf to Ctrl-C meanwhile
                    raise_on_lease_renewal_failure=False,
                )
            )
        try:
            yield
        finally:
            with _noted():
                slot.close()


@contextmanager
def _noted() -> Iterator[None]:
    """Prefect's trouble with a limit is for its log alone."""
    try:
        yield
    except Exception as error:
        logging.getLogger(__name__).debug("limit of GPU stages", exc_info=error)


def perform(root: Path, scheduler: Scheduler, tasks: Tasks) -> None:
    """Run the scheduler's stages as a Prefect flow. Raises UserError, KeyboardInterrupt."""
    from app.flow.server import served

    try:
        with served(root) as url:  # from here on Prefect may be imported
            say(f"seen at {url}")
            try:
                _prepare(scheduler)
                state = Run(scheduler, tasks)()
                if not tasks.interrupted and (scheduler.waiting or scheduler.running):
                    ended = one_line(state.message or state.name)
                    raise UserError(f"Prefect ended the flow early ({ended}); run it again")
            finally:
                _flush()
    except UserError:
        raise
    except Exception as error:
        if not (scheduler.waiting or scheduler.running or tasks.interrupted):
            say("Prefect's server went away before the end; its history lacks some of it")
        elif not tasks.interrupted:
            expect_room(root)  # its server's answer is a bare 500
            raise UserError(
                f"Prefect failed ({type(error).__name__}: {one_line(error)});"
                " `dvc repro` does the same without it, one stage at a time"
            ) from error
    if tasks.interrupted:
        raise KeyboardInterrupt


class Run:
    """A flow run: it fills the scheduler, and a task of Prefect's follows each stage."""

    def __init__(self, scheduler: Scheduler, tasks: Tasks) -> None:
        self.scheduler, self.tasks = scheduler, tasks
        self._futures: dict = {}  # by stage
        self._ended: SimpleQueue[Stage] = SimpleQueue()

    def __call__(self):
        """Run it; the state that Prefect ends it in."""
        import prefect

        name, tags = reporter.names(self.scheduler.waiting)
        with prefect.tags(*tags):
            flow = prefect.flow(
                name="sling flow",
                flow_run_name=name,
                persist_result=False,
                validate_parameters=False,
            )(self._body)
            return flow(return_state=True)

    def _body(self):
        from prefect.exceptions import TerminationSignal
        from prefect.states import Cancelled, Completed, Failed

        scheduler, tasks = self.scheduler, self.tasks
        try:
            self._run_all()
        except (KeyboardInterrupt, TerminationSignal):
            tasks.interrupted = True
            tasks.cancelled.set()
            say("ending the stages that run")
            scheduler.stop()
            for name in [*scheduler.running]:  # who ended as it came may be in no queue
                self._close(tasks.graph.stages[name], guard.GRACE + 15)
            return Cancelled(message=scheduler.summary())
        except BaseException:
            tasks.cancelled.set()  # Prefect waits for the threads
            raise
        if scheduler.failed:
            return Failed(message=f"{scheduler.summary()}; {next(iter(scheduler.failed.values()))}")
        return Completed(message=scheduler.summary())

    def _run_all(self) -> None:
        while True:
            while found := self.scheduler.next():
                self._submit(*found)
            if not self.scheduler.running:
                return
            self._close(self._ended.get())

    def _submit(self, stage: Stage, share: dict[str, str]) -> None:
        import prefect
        from prefect.cache_policies import NO_CACHE

        task = prefect.task(
            name=stage.step,
            task_run_name=stage.name,
            tags=reporter.tags(stage),
            cache_policy=NO_CACHE,
            persist_result=False,
        )(self._task)
        producers = [self._futures[name] for name in stage.producers if name in self._futures]
        self._futures[stage.name] = future = task.submit(  # pyright: ignore[reportCallIssue]
            stage, share, wait_for=producers
        )
        future.add_done_callback(lambda _: self._ended.put(stage))

    def _task(self, stage: Stage, share: dict[str, str]):
        from prefect.states import Cancelled, Completed

        try:
            ran = self.tasks(stage, share)
        except child.Cancelled:
            return Cancelled(message="interrupted")
        return True if ran else Completed(name="Fresh", message="nothing to do", data=False)

    def _close(self, stage: Stage, timeout: float | None = None) -> None:
        """Tell the scheduler of the end of a stage, for which to wait so many seconds."""
        future = self._futures.get(stage.name)
        if future:  # else it was interrupted before it was one
            self.scheduler.done(stage, _outcome(future, stage, timeout))


def _outcome(future, stage: Stage, timeout: float | None = None) -> bool | UserError:
    """What a task ends with, within so many seconds; a fault of ours is a failed stage too."""
    from prefect.exceptions import CancelledRun

    try:
        return future.result(timeout=timeout)
    except UserError as error:
        return error
    except CancelledRun:
        return child.StageFailed(f"{stage.name}: interrupted")
    except Exception as error:
        logging.getLogger(__name__).debug("%s", stage.name, exc_info=error)
        return child.StageFailed(f"{stage.name}: {type(error).__name__}: {one_line(error)}")


def _flush() -> None:
    """Prefect's last events and lines, which it sends from threads, while its server is there."""
    from prefect.events.worker import EventsWorker
    from prefect.logging.handlers import APILogWorker

    for sender in (EventsWorker, APILogWorker):
        sender.drain_all(timeout=10)


def _prepare(scheduler: Scheduler) -> None:
    """Clear up after flows that were killed, for no other one is at work; set the GPU limit."""
    from prefect.client.orchestration import get_client
    from prefect.client.schemas.actions import GlobalConcurrencyLimitCreate
    from prefect.client.schemas.filters import FlowRunFilter, TaskRunFilter
    from prefect.exceptions import ObjectNotFound
    from prefect.states import Crashed

    running, killed = {"state": {"type": {"any_": ["RUNNING"]}}}, Crashed(message="was killed")
    with get_client(sync_client=True) as client:
        for run in client.read_task_runs(task_run_filter=TaskRunFilter.model_validate(running)):
            client.set_task_run_state(run.id, killed, force=True)
        for run in client.read_flow_runs(flow_run_filter=FlowRunFilter.model_validate(running)):
            client.set_flow_run_state(run.id, killed, force=True)
        if scheduler.shares is None:
            return
        with suppress(ObjectNotFound):  # with slots that are still taken
            client.delete_global_concurrency_limit_by_name(GPU_LIMIT)
        client.create_global_concurrency_limit(
            GlobalConcurrencyLimitCreate(name=GPU_LIMIT, limit=len(scheduler.shares))
        )


def say(line: str, stage: Stage | None = None) -> None:
    """One line on the terminal, whole even where threads print at once."""
    sys.stdout.write(f"{stage.name} | {line}\n" if stage else f"{line}\n")
    sys.stdout.flush()


def lasted(start: float) -> str:
    seconds = time.monotonic() - start
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {seconds} s"
