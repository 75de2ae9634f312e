"""What becomes of a flow that Prefect ends before its time; the rest is in test_run.py."""

import shutil
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.flow import tasks
from app.flow.graph import Stage
from app.flow.scheduler import Scheduler
from pipeline.base.errors import UserError

STATE = SimpleNamespace(name="Failed", message="it raised:\n  RuntimeError: no\nmore")


def test_a_flow_that_prefect_ends_early_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Prefect keeps what the body of a flow raises, and returns its state."""
    stage = Stage("one", "one", "", (), False)
    for name in ("_prepare", "_flush"):
        monkeypatch.setattr(tasks, name, lambda *_: None)
    monkeypatch.setattr(tasks, "Run", lambda *_: lambda: STATE)
    monkeypatch.setattr("app.flow.server.served", lambda root: nullcontext("nowhere"))
    early = r"^Prefect ended the flow early \(it raised: .* no more\); run"
    for waiting, interrupted, ends in (
        ([stage], False, pytest.raises(UserError, match=early)),
        ([], True, pytest.raises(KeyboardInterrupt)),
        ([], False, nullcontext()),
    ):
        with ends:
            tasks.perform(Path(), Scheduler(waiting, 1), SimpleNamespace(interrupted=interrupted))


def test_prefects_failure_on_a_full_disk_is_the_disks(tmp_path, monkeypatch) -> None:
    """Its server answers with a bare 500."""

    def fails(*_) -> None:
        raise RuntimeError("500 Internal Server Error")

    for name, stub in (("_prepare", fails), ("_flush", lambda: None)):
        monkeypatch.setattr(tasks, name, stub)
    monkeypatch.setattr("app.flow.server.served", lambda root: nullcontext("nowhere"))
    stage = Stage("one", "one", "", (), False)
    usage = shutil.disk_usage(tmp_path)
    for free, says in ((10_000, "No space left on device"), (10**8, "500 Internal")):
        found = usage._replace(free=free)
        monkeypatch.setattr(shutil, "disk_usage", lambda _, found=found: found)
        with pytest.raises(UserError, match=says):
            tasks.perform(tmp_path, Scheduler([stage], 1), SimpleNamespace(interrupted=False))
