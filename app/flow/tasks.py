"""The stages of a flow: each in a thread that waits for the stage's child."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from threading import Event

from app.flow import child
from app.flow.graph import Graph, Stage
from app.flow.log import RunLog
from app.flow.scheduler import Scheduler
from pipeline.base.errors import UserError, one_line

Place = Callable[..., bool]


@dataclass
class Tasks:
    """What happens with a stage, in a thread of its own."""

    root: Path
    graph: Graph
    environment: Mapping[str, str]
    place: Place
    log: RunLog
    cancelled: Event = field(default_factory=Event)

    def __call__(self, stage: Stage, share: Mapping[str, str]) -> bool | UserError:
        """Whether the stage ran, False if there was nothing to do; or why it failed."""
        self.log.begins(stage.name, stage.producers)
        try:
            state = self._run(stage, share)
        except child.Cancelled:
            self.log.ended(stage.name, "cancelled", "interrupted")
            return child.StageFailed(f"{stage.name}: interrupted")
        except UserError as error:
            return self._failed(stage, error)
        except Exception as error:  # a fault of ours is a failed stage too
            logging.getLogger(__name__).debug("%s", stage.name, exc_info=error)
            why = f"{stage.name}: {type(error).__name__}: {one_line(error)}"
            return self._failed(stage, child.StageFailed(why))
        self.log.ended(stage.name, state)
        return state == "ran"

    def _failed(self, stage: Stage, error: UserError) -> UserError:
        self.log.ended(stage.name, "failed", str(error))
        return error

    def _run(self, stage: Stage, share: Mapping[str, str]) -> str:
        if self.graph.is_fresh(stage.name):
            say("is fresh", stage)
            return "fresh"
        start = time.monotonic()

        def on_line(line: str) -> None:
            say(line, stage)
            self.log.line(stage.name, line)

        say("begins", stage)
        ran = self.place(
            self.root,
            stage.name,
            environment={**self.environment, **share},
            on_line=on_line,
            cancelled=self.cancelled.is_set,
        )
        say(f"{'done' if ran else 'taken from the cache'} ({lasted(start)})", stage)
        return "ran" if ran else "cached"


def perform(scheduler: Scheduler, tasks: Tasks) -> None:
    """Run the scheduler's stages. An interrupt ends those that run, and then goes on."""
    ended: SimpleQueue[tuple[Stage, bool | UserError]] = SimpleQueue()
    with ThreadPoolExecutor(scheduler.workers, thread_name_prefix="stage") as threads:

        def run(stage: Stage, share: Mapping[str, str]) -> None:
            ended.put((stage, tasks(stage, share)))

        try:
            while True:
                while ready := scheduler.next():
                    threads.submit(run, *ready)
                if not scheduler.running:
                    return
                scheduler.done(*ended.get())
        except BaseException as error:
            tasks.cancelled.set()  # the threads are waited for
            if isinstance(error, KeyboardInterrupt):
                say("ending the stages that run")
            raise


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
