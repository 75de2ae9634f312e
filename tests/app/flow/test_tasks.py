"""What becomes of a flow that Prefect ends before its time; the rest is in test_run.py."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.flow import tasks
from app.flow.graph import Stage
from app.flow.scheduler import Scheduler
from pipeline.base.errors import UserError

STATE = SimpleNamespace(name="Failed", message="it raised:\n  RuntimeError: no\nmore")


@pytest.mark.parametrize(
    ("waiting", "interrupted", "ends"),
    [
        (True, False, (UserError, r"^Prefect ended the flow early \(it raised: .* no more\); run")),
        (False, True, (KeyboardInterrupt, "^$")),
        (False, False, None),
    ],
)
def test_a_flow_that_prefect_ends_early_is_an_error(
    monkeypatch: pytest.MonkeyPatch, waiting: bool, interrupted: bool, ends
) -> None:
    """Prefect keeps what the body of a flow raises, and returns its state."""
    stage = Stage("one", "one", "", (), False)
    scheduler = Scheduler([stage] if waiting else [], 1)
    for name in ("_prepare", "_flush"):
        monkeypatch.setattr(tasks, name, lambda *_: None)
    monkeypatch.setattr(tasks, "Run", lambda *_: lambda: STATE)
    monkeypatch.setattr("app.flow.server.served", lambda root: nullcontext("nowhere"))
    all_of_it = SimpleNamespace(interrupted=interrupted)
    with pytest.raises(ends[0], match=ends[1]) if ends else nullcontext():
        tasks.perform(Path(), scheduler, all_of_it)
