"""What Prefect shows of a stage: its lines as they come, a bar while it searches or trains, and
pictures and tables of what it wrote. No trouble of Prefect's reaches the stage.
"""

from __future__ import annotations

import contextvars
import re
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import cast
from uuid import UUID

from app.flow.artifacts import artifact
from app.flow.graph import Stage
from pipeline.base.progress import Step, parse

EVERY = 1.0  # s, between two moves of a bar
BAR = 10  # characters; Prefect shows its own bar as a ring, and as a number
WAITING = 60.0  # s, for the last artifacts of a stage
NAMED = 3  # methods in a flow run's name


class Reporter:
    """Reports one stage; to be made in its task.

    Logging is Prefect's, in its own thread; artifacts are made in a thread of ours, so that a
    server that is slow or gone keeps no stage. Once it has failed, no more are made.
    """

    def __init__(self, stage: Stage, root: Path) -> None:
        self.stage, self.root = stage, root
        self._logger = _logger()
        self._context = contextvars.copy_context()  # says whose artifacts they are
        self._thread = ThreadPoolExecutor(1, thread_name_prefix=f"reporter {stage.name}")
        self._moved: dict[str, float] = {}  # when, by title
        self._bars: dict[str, UUID] = {}  # ids, by title
        self._failed = self._logger is None

    def __call__(self, line: str) -> None:
        """Show a line of the stage's output."""
        if self._logger:
            (self._logger.error if line.startswith("error: ") else self._logger.info)(line)
        step, now = parse(line), time.monotonic()
        if step and (step.done == step.total or now - self._moved.get(step.title, -EVERY) >= EVERY):
            self._moved[step.title] = now
            self._post(self._move, step)

    def done(self) -> None:
        """Show what the stage wrote."""
        last = self._post(self._show)
        self._thread.shutdown(wait=False)
        if last:
            try:
                last.result(WAITING)
            except TimeoutError:
                self._failed = True

    def _post(self, work, *arguments):
        return None if self._failed else self._thread.submit(self._try, work, *arguments)

    def _try(self, work, *arguments) -> None:
        if self._failed or not self._logger:
            return
        try:
            self._context.run(work, *arguments)
        except Exception as error:
            self._failed = True
            self._logger.warning("no more artifacts of %s: %s", self.stage.name, error)

    def _move(self, step: Step) -> None:
        from prefect.artifacts import create_progress_artifact, update_progress_artifact

        share = 100 * step.done / step.total
        filled = BAR * step.done // step.total
        words = " · ".join(["█" * filled + "░" * (BAR - filled), *step.counted.split("  ")])
        if step.title in self._bars:
            update_progress_artifact(self._bars[step.title], share, words)
        else:
            made = create_progress_artifact(share, key(step.title), words)
            self._bars[step.title] = cast(UUID, made)  # in a thread it is no coroutine

    def _show(self) -> None:
        text = artifact(self.stage, self.root)
        if text:
            from prefect.artifacts import create_markdown_artifact

            create_markdown_artifact(text, key(self.stage.name), self.stage.name)


def _logger():
    """Of the task that runs this; None outside of any."""
    from prefect import get_run_logger
    from prefect.exceptions import MissingContextError

    try:
        return get_run_logger()
    except MissingContextError:
        return None


def key(name: str) -> str:
    """An artifact's key, of small letters, digits and single dashes."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def tags(stage: Stage) -> list[str]:
    """Its band and its method."""
    return [part for part in stage.item.split("-", 1) if part]


def names(stages: Iterable[Stage]) -> tuple[str, list[str]]:
    """A flow run's name, by bands and methods, and its tags: all of both."""
    items = [tags(stage) for stage in stages]
    bands = list(dict.fromkeys(item[0] for item in items if item))
    methods = list(dict.fromkeys(item[1] for item in items if len(item) > 1))
    more = [f"{len(methods) - NAMED} more"] if len(methods) > NAMED else []
    parts = [", ".join(bands), ", ".join([*methods[:NAMED], *more])]
    return ": ".join(filter(None, parts)) or "report", [*bands, *methods]
