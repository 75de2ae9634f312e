"""The large budget in params.yaml; how long the run took, though it was killed."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.base.errors import UserError
from pipeline.params import load
from tests.project import ROOT, until
from tools.large import KEPT, timed, with_budget
from validation.benchmarks.methods import LARGE

RUN = ["sh", "-c", "test -e finish || exec sleep 60"]
TOLD = "import sys; from pathlib import Path; from tools.large import timed;"


def seconds(folder: Path) -> float:
    """That are noted of the first stretch."""
    kept = folder / KEPT
    return json.loads(kept.read_text())["stretches"][0] if kept.is_file() else -1.0


def test_stretches_add_up_over_a_kill_until_a_run_succeeds(tmp_path: Path) -> None:
    code = f"{TOLD} timed({RUN}, Path({str(tmp_path)!r}), tick=0.05)"
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, start_new_session=True) as first:
        try:
            until(lambda: first.poll() is None and seconds(tmp_path) >= 0.3)
        finally:
            os.killpg(first.pid, signal.SIGKILL)
    (tmp_path / "finish").touch()
    status, (before, last) = timed(RUN, tmp_path)
    assert status == 0 and 0.3 <= before < 60 and last < 0.3
    assert not (tmp_path / KEPT).exists()
    assert len(timed(RUN, tmp_path)[1]) == 1


def test_a_run_that_fails_keeps_its_time_and_another_command_begins_anew(tmp_path: Path) -> None:
    fails = ["sh", "-c", "exit 3"]
    assert [timed(fails, tmp_path) for _ in range(2)][1] == (3, [0.0, 0.0])
    assert len(timed(["true"], tmp_path)[1]) == 1


def test_the_budget_is_all_that_changes_in_params(tmp_path: Path) -> None:
    before, path = (ROOT / "params.yaml").read_text(encoding="utf-8"), tmp_path / "params.yaml"
    path.write_text(before, encoding="utf-8")
    with_budget(path)
    after = path.read_text(encoding="utf-8")
    assert {name: getattr(load(path).optimizer, name) for name in LARGE} == LARGE
    changed = [
        (old, new)
        for old, new in zip(before.splitlines(), after.splitlines(), strict=True)
        if old != new
    ]
    assert len(changed) == len(LARGE)
    assert all(old.partition("#")[1:] == new.partition("#")[1:] for old, new in changed)


def test_a_budget_that_stands_otherwise_is_refused_and_nothing_changes(tmp_path: Path) -> None:
    path = tmp_path / "params.yaml"
    text = (ROOT / "params.yaml").read_text(encoding="utf-8")
    text = text.replace("  generations: 8", "  'generations': 8")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match="optimizer.generations: 39 on a line of its own"):
        with_budget(path)
    assert path.read_text(encoding="utf-8") == text


def test_a_termination_ends_the_run_as_well(tmp_path: Path) -> None:
    code = f"import sys; {TOLD} sys.exit(timed({RUN}, Path({str(tmp_path)!r}), tick=0.05)[0] != 0)"
    process = subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, start_new_session=True)
    try:
        until(lambda: seconds(tmp_path) >= 0)
        process.terminate()
        assert process.wait(20) == 1
        with pytest.raises(ProcessLookupError):
            os.killpg(process.pid, 0)  # nobody is left
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
