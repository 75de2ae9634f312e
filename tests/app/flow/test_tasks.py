"""What becomes of a flow that Prefect ends before its time; the rest is in test_run.py."""

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
