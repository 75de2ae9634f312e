"""What a run leaves of itself: a file of JSON lines in logs/runs/, which `sling ui` shows.

Each line has `at` [s since 1970] and `what`:

    begins  a run: `id`, `command`, `name`, `tags`
    stage   a stage begins: `stage`, `producers`
    line    `text` of a `stage`
    ended   a `stage`, or without one the run: `state`, `message`; with the run, `made`

States are "ran", "fresh", "cached", "failed" and "cancelled"; a run without an end was killed. Its
file is locked for as long as it lasts, so that a reader can tell.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import re
import time
import uuid
from collections.abc import Iterable, Sequence
from io import FileIO
from pathlib import Path
from threading import Lock

from pipeline.base.errors import UserError

FOLDER = Path("logs", "runs")
KEPT = 50  # runs
NAMED = 3  # methods in a run's name


class RunLog:
    """Writes the log of one run, from any thread; a context manager, whose exceptions it notes.

    A run of which no stage begins leaves none. A log that cannot be written stops no run.
    """

    def __init__(self, root: Path, command: str, stages: Iterable[str]) -> None:
        """Prepare the log of a command; the bands and methods of `stages` name the run."""
        self.root, self._lock, self._failed = Path(root), Lock(), False
        self._file: FileIO | None = None
        self._ran: list[str] = []
        self.message = ""  # how the run ended, in words
        name, tags = names(stages)
        header = {"id": uuid.uuid4().hex, "command": command, "name": name, "tags": tags}
        self._begins = {"at": time.time(), "what": "begins", **header}

    def __enter__(self) -> RunLog:
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if self._file is None:
            return
        state = "ran"
        if error is not None:
            state = "failed" if isinstance(error, Exception) else "cancelled"
            why = str(error) if isinstance(error, UserError) else type(error).__name__
            self.message = "; ".join(filter(None, [self.message, why]))
        made = {stage: digest for stage in self._ran if (digest := entry(self.root, stage))}
        self._write(what="ended", state=state, message=self.message, made=made)
        self._file.close()

    def begins(self, stage: str, producers: Sequence[str] = ()) -> None:
        self._write(what="stage", stage=stage, producers=[*producers])

    def line(self, stage: str, text: str) -> None:
        self._write(what="line", stage=stage, text=text)

    def ended(self, stage: str, state: str, message: str = "") -> None:
        if state == "ran":
            self._ran.append(stage)
        self._write(what="ended", stage=stage, state=state, message=message)

    def _write(self, **event: object) -> None:
        with self._lock:
            if self._failed:
                return
            try:
                if self._file is None:
                    self._file = self._opened()
                    self._put(self._begins)
                self._put({"at": time.time(), **event})
            except OSError:
                self._failed = True

    def _put(self, event: dict) -> None:
        if self._file:
            self._file.write(json.dumps(event, ensure_ascii=False).encode(errors="replace") + b"\n")

    def _opened(self) -> FileIO:
        folder = self.root / FOLDER
        folder.mkdir(parents=True, exist_ok=True)
        for old in sorted(folder.glob("*.jsonl"))[: 1 - KEPT]:
            old.unlink(missing_ok=True)
        when = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime(self._begins["at"]))
        file = (folder / f"{when}-{self._begins['id'][:8]}.jsonl").open("ab", buffering=0)
        with contextlib.suppress(OSError):  # some network drives lock nothing
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return file


def tags(stage: str) -> list[str]:
    """Band and method of a stage, by its name: theta@band1-least_squares."""
    return [part for part in stage.partition("@")[2].split("-", 1) if part]


def names(stages: Iterable[str]) -> tuple[str, list[str]]:
    """A run's name, by bands and methods, and its tags: all of both."""
    items = [tags(stage) for stage in stages]
    bands = list(dict.fromkeys(item[0] for item in items if item))
    methods = list(dict.fromkeys(item[1] for item in items if len(item) > 1))
    more = [f"{len(methods) - NAMED} more"] if len(methods) > NAMED else []
    parts = [", ".join(bands), ", ".join([*methods[:NAMED], *more])]
    return ": ".join(filter(None, parts)) or "report", [*bands, *methods]


def entry(root: Path, stage: str) -> str:
    """Digest of what dvc.lock says of a stage, and so of all that it read and made; "" of none."""
    try:
        text = (root / "dvc.lock").read_text(encoding="utf-8")
    except OSError:
        return ""
    match = re.search(rf"^  {re.escape(stage)}:\n(?:    .*\n)+", text, re.MULTILINE)
    return hashlib.md5(match[0].encode()).hexdigest() if match else ""
