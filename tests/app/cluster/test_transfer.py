"""DVC's transfers run behind a guard, as stages do: they hear an interrupt, and say one line."""

from pathlib import Path

import pytest

from app.cluster import exchange
from app.flow import child
from pipeline.base.errors import UserError
from tests.app.cluster.several import Copy, toy
from tests.project import alive

# Python reads it at its start: notes its number and waits, as a transfer of many files does.
WAITS = """\
import os, pathlib, sys, time
if "push" in sys.argv and "repro" not in sys.argv and not sys.flags.isolated:
    pathlib.Path("pid").write_text(str(os.getpid()))
    time.sleep(600)
"""


@pytest.fixture
def head(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Copy:
    head = toy(tmp_path / "head")
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", head.environment["DVC_SITE_CACHE_DIR"])
    return head


def test_a_cancelled_transfer_leaves_nothing(
    head: Copy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sitecustomize.py").write_text(WAITS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    pid = head.folder / "pid"
    with pytest.raises(child.Cancelled):
        exchange.transfer(
            head.folder, "push", ("search@a",), lambda: pid.exists() and bool(pid.read_text())
        )
    assert not alive(int(pid.read_text()))


def test_a_cancelled_transfer_does_not_begin(head: Copy) -> None:
    with pytest.raises(child.Cancelled):
        exchange.transfer(head.folder, "push", ("search@a",), lambda: True)
    assert not (head.folder / ".dvc/tmp").exists()


def test_a_transfer_that_fails_says_why_in_one_line(head: Copy) -> None:
    with pytest.raises(UserError, match="^[^\n]*: dvc push nothing: [^\n]*'nothing'[^\n]*$"):
        exchange.transfer(head.folder, "push", ("nothing",), lambda: False)
