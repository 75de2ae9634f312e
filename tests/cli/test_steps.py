"""How far a command is: a bar on a terminal, lines in a log."""

import sys

import pytest

from sling2sim2real.cli.steps import Steps

COSTS = {"read": 1.0, "fit": 3.0}


def test_a_log_has_lines(capsys: pytest.CaptureFixture) -> None:
    steps = Steps(COSTS)
    steps.begin("read")
    steps.say("one pull")
    steps.finish()
    assert capsys.readouterr().err == "[1/2] read; about 0:04 left\n      one pull\n"


def test_a_terminal_has_a_bar_below_the_lines(capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    steps = Steps(COSTS)
    steps.begin("fit")
    steps.say("settled")
    steps.finish()
    drawn, above, cleared = capsys.readouterr().err.split("\r\x1b[K")[1:]
    assert drawn.startswith(f"[{'#' * 6}{'-' * 18}] fit") and "\n" not in drawn
    assert above == f"      settled\n{drawn}" and cleared == ""
