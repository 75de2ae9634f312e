"""Stage scripts as a user calls them: every mistake is one line."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OF_A_BAND = ("record", "episode", "mounting")
OF_A_METHOD = ("history", "clusters", "refined", "theta", "policy", "trials")


@pytest.fixture
def stage(tmp_path: Path, monkeypatch, capsys) -> Callable[..., tuple[int, str]]:
    """Run a script where nothing has run yet: its exit status and its one line on stderr."""
    (tmp_path / "params.yaml").write_bytes((ROOT / "params.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)

    def run(name: str, *arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["", *arguments])
        with pytest.raises(SystemExit) as ended:
            runpy.run_module(f"stages.{name}", run_name="__main__", alter_sys=True)
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1, lines
        return ended.value.code, lines[0]

    return run


@pytest.mark.parametrize("name", [*OF_A_BAND, *OF_A_METHOD, "report"])
def test_wrong_arguments_are_answered_by_the_usage(name: str, stage) -> None:
    words = {"report": ""}.get(name, " BAND" if name in OF_A_BAND else " BAND METHOD")
    expected = (2, f"usage: python -m stages.{name}{words}")
    assert stage(name, "a", "b", "c") == expected
    if words:
        assert stage(name) == expected


def test_unknown_names(stage) -> None:
    status, line = stage("history", "band9", "sling2sim2real")
    assert status == 1 and line.startswith("error: band band9: not in params.yaml, which has band1")
    status, line = stage("theta", "band1", "best")
    assert status == 1 and line.startswith("error: method best: not in params.yaml, which has")


@pytest.mark.parametrize("name", [*OF_A_BAND[1:], *OF_A_METHOD, "report"])
def test_missing_inputs(name: str, stage) -> None:
    method = ("sling2sim2real",) if name in OF_A_METHOD else ()
    band = ("band1",) if name != "report" else ()
    status, line = stage(name, *band, *method)
    assert status == 1 and line.startswith("error: data/"), line
    assert "missing; `dvc repro " in line or "no such file" in line, line
