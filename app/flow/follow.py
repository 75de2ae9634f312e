"""The logs of runs, brought into Prefect's database, so that its UI shows them.

Each run is there once, however often its log is read: its rows bear ids that follow from the run's,
and it knows up to where its log is in. Prefect's client cannot say when something was, so rows are
written by the functions behind its API (`prefect.server.models`), beside a server or without one.
Prefect's settings must be in the environment before this is imported.
"""

from __future__ import annotations

import asyncio
import fcntl
import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from uuid import UUID, uuid5

from prefect.server import models
from prefect.server.database import provide_database_interface
from prefect.server.schemas import actions, core, states

from app.flow.artifacts import artifact
from app.flow.log import FOLDER, entry, tags
from pipeline.base.errors import one_line
from pipeline.base.progress import Step, parse

BAR = 10  # characters; Prefect shows its own bar as a ring, and as a number
EVERY = 1.0  # s, between two looks at the logs
STATES = {  # of a log, as Prefect has them: type and name
    "ran": (states.StateType.COMPLETED, "Completed"),
    "fresh": (states.StateType.COMPLETED, "Fresh"),
    "cached": (states.StateType.COMPLETED, "Cached"),
    "failed": (states.StateType.FAILED, "Failed"),
    "cancelled": (states.StateType.CANCELLED, "Cancelled"),
    "killed": (states.StateType.CRASHED, "Crashed"),
}


async def follow(root: Path, alive: Callable[[], bool]) -> None:
    """Show all runs, and what they do, for as long as `alive` says."""
    logs: dict[Path, Log] = {}
    while alive():
        for path in sorted((root / FOLDER).glob("*.jsonl")):
            log = logs.setdefault(path, Log(path, root))
            if log.over:
                continue
            try:
                await log.show()
            except Exception as error:  # of one log: the others are shown all the same
                log.over = True
                print(f"{path}: is shown no further ({one_line(error)})", file=sys.stderr)
        await asyncio.sleep(EVERY)


@dataclass
class Log:
    """One run's log, and how far it is shown.

    Attributes:
        over: Whether all that will ever be in it is shown.
        read: Bytes of it that are in the database.
        id: Of the flow run.
        open: Stages that have begun and not ended.
    """

    path: Path
    root: Path
    over: bool = False
    read: int = 0
    id: UUID | None = None
    open: list[str] = field(default_factory=list)

    async def show(self) -> None:
        """Bring what is new in the log into the database."""
        alive = self._alive()  # asked first: what a run wrote before its end is there by then
        text = self.path.read_bytes()
        events, at = [], 0
        for line in text[: text.rfind(b"\n") + 1].splitlines(keepends=True):
            at += len(line)
            events.append((at, json.loads(line)))
        if not events:
            self.over = not alive
            return
        if self.id is None:
            self.id = UUID(events[0][1]["id"])
            self.read = await _known(self.id)
            for _, event in (placed for placed in events if placed[0] <= self.read):
                self._notes(event)
        last = events[-1][1]
        ended = last["what"] == "ended" and "stage" not in last
        batch: list[dict] = []
        for at, event in events:
            if at <= self.read:
                continue
            batch.append(event)
            picture = ""
            if event["what"] == "ended" and event["state"] == "ran" and "stage" in event:
                made = last["made"].get(event["stage"]) if ended else None
                if made == entry(self.root, event["stage"]) if ended else alive:
                    picture = self._picture(event["stage"])
            elif event is not last:
                continue
            await self._write(batch, at, picture)
            batch.clear()
        if not (ended or alive) and self.read == at:  # once
            end = {"at": last["at"], "what": "ended", "state": "killed", "message": "was killed"}
            await self._write([end], at + 1, "")
        self.over = ended or not alive

    def _alive(self) -> bool:
        """Whether whoever writes the log still does: it holds a lock."""
        with self.path.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
            except OSError:  # nothing can be locked here
                pass
        return False

    def _picture(self, stage: str) -> str:
        """What there is to show of what a stage made, as markdown."""
        try:
            return artifact(stage, self.root)
        except Exception as error:
            return f"not drawn: {one_line(error)}"

    def _notes(self, event: dict) -> None:
        """Know by an event which stages are at work."""
        if event["what"] == "stage":
            self.open.append(event["stage"])
        elif event["what"] == "ended" and event.get("stage") in self.open:
            self.open.remove(event["stage"])

    async def _write(self, events: list[dict], read: int, picture: str) -> None:
        """Have these events in the database, and that the log is in up to `read`; or nothing."""
        lines: list[actions.LogCreate] = []
        bars: dict[str, tuple[Step, str]] = {}  # the last one, by title
        async with provide_database_interface().session_context(begin_transaction=True) as session:
            for event in events:
                stage = event.get("stage", "")
                if event["what"] == "begins":
                    await self._begin(session, event)
                elif event["what"] == "stage":
                    await self._begin_stage(session, stage, event)
                elif event["what"] == "ended":
                    await self._end(session, event)
                elif event["what"] == "line":
                    lines.append(self._line(stage, event["text"], event["at"]))
                    if step := parse(event["text"]):
                        bars[step.title] = step, stage
                self._notes(event)
            for step, stage in bars.values():
                await self._bar(session, step, stage)
            if picture:
                stage = events[-1]["stage"]
                await self._artifact(session, stage, stage, "markdown", picture, stage)
            if lines:
                await models.logs.create_logs(session, lines)
            if run := await models.flow_runs.read_flow_run(session, self._run):
                run.context = {"read": read}
        self.read = read

    @property
    def _run(self) -> UUID:
        assert self.id is not None
        return self.id

    def _task(self, stage: str) -> UUID:
        return uuid5(self._run, stage)

    async def _begin(self, session: Any, event: dict) -> None:
        flow = await models.flows.create_flow(session, core.Flow(name=event["command"]))
        run = core.FlowRun(id=self._run, flow_id=flow.id, name=event["name"], tags=event["tags"])
        await models.flow_runs.create_flow_run(session, run)
        running = _state(states.StateType.RUNNING, "Running", event["at"])
        await models.flow_runs.set_flow_run_state(session, self._run, running, force=True)

    async def _begin_stage(self, session: Any, stage: str, event: dict) -> None:
        task = core.TaskRun(
            id=self._task(stage),
            flow_run_id=self._run,
            name=stage,
            task_key=stage.partition("@")[0],
            dynamic_key=stage,
            tags=tags(stage),
            task_inputs={
                "wait_for": [
                    core.TaskRunResult(id=self._task(producer)) for producer in event["producers"]
                ]
            },
        )
        await models.task_runs.create_task_run(session, task)
        running = _state(states.StateType.RUNNING, "Running", event["at"])
        await models.task_runs.set_task_run_state(session, task.id, running, force=True)

    async def _end(self, session: Any, event: dict) -> None:
        """Set the end of a stage, or of the run with all that is still at work."""
        payload = *STATES[event["state"]], event["at"], event["message"]
        for stage in [event["stage"]] if "stage" in event else self.open:
            task = self._task(stage)
            await models.task_runs.set_task_run_state(session, task, _state(*payload), force=True)
        if "stage" not in event:
            run = self._run
            await models.flow_runs.set_flow_run_state(session, run, _state(*payload), force=True)

    def _line(self, stage: str, text: str, at: float) -> actions.LogCreate:
        return actions.LogCreate(
            name="sling",
            level=40 if text.startswith("error: ") else 20,  # as `logging` has them
            message=text,
            timestamp=_when(at),
            flow_run_id=self._run,
            task_run_id=self._task(stage),
        )

    async def _bar(self, session: Any, step: Step, stage: str) -> None:
        filled = BAR * step.done // step.total
        words = " · ".join(["█" * filled + "░" * (BAR - filled), *step.counted.split("  ")])
        share = 100 * step.done / step.total
        await self._artifact(session, step.title, stage, "progress", share, words)

    async def _artifact(
        self, session: Any, title: str, stage: str, kind: str, data: object, words: str
    ) -> None:
        """Make it, or change the one that there is."""
        artifact_id = uuid5(self._task(stage), f"{kind} {title}")
        payload = {"data": data, "description": words}
        change = actions.ArtifactUpdate.model_validate(payload)
        if await models.artifacts.update_artifact(session, artifact_id, change):
            return
        of = {"flow_run_id": self._run, "task_run_id": self._task(stage)}
        new = core.Artifact.model_validate(
            {"id": artifact_id, "key": key(title), "type": kind, **payload, **of}
        )
        await models.artifacts.create_artifact(session, new)


async def _known(run: UUID) -> int:
    """Up to where the log of a run is in the database."""
    async with provide_database_interface().session_context() as session:
        flow_run = await models.flow_runs.read_flow_run(session, run)
        return flow_run.context["read"] if flow_run else 0


def _state(kind: states.StateType, name: str, at: float, message: str = "") -> states.State:
    return states.State(type=kind, name=name, timestamp=_when(at), message=message or None)


def _when(at: float) -> Any:
    return datetime.fromtimestamp(at, UTC)


def key(name: str) -> str:
    """An artifact's key, of small letters, digits and single dashes."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
