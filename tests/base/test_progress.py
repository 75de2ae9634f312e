"""Lines of long things: what they say, that they are read back, and that they are not too many."""

import sys
from pathlib import Path

import pytest

from sling2sim2real.base import progress
from sling2sim2real.base.progress import Progress, Step, parse


@pytest.fixture
def clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A folder for logs, and a clock that stands until it is set."""
    monkeypatch.chdir(tmp_path)

    class Clock:
        now = 100.0

        def monotonic(self) -> float:
            return self.now

        def strftime(self, form: str) -> str:
            return form

    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def test_a_line_says_rate_and_time_left(clock, capsys: pytest.CaptureFixture) -> None:
    summary = Progress("policy-band1-x", 400, "iterations")
    for seconds in (2.0, 0.5):
        clock.now += seconds
        summary.advance(10, "mean error 0.52 cm")
    first, second = capsys.readouterr().err.splitlines()
    what = "iterations  mean error 0.52 cm"
    assert first == f"policy-band1-x 10/400 {what}  5.0 iterations/s  1:18 left"
    assert second == f"policy-band1-x 20/400 {what}  20.0 iterations/s  0:48 left"  # mean rate: 8
    header, *lines = Path("logs/policy-band1-x.log").read_text().splitlines()
    assert header.endswith("policy-band1-x: 400 iterations")
    assert [f"policy-band1-x {line}" for line in lines] == [first, second]


def test_lines_are_told_no_more_often_than_asked_but_the_last_is(clock, capsys) -> None:
    summary = Progress("x", 26, "iterations", every=1.0)
    for _ in range(26):
        clock.now += 0.125
        summary.advance(1)
    steps = [parse(line) for line in capsys.readouterr().err.splitlines()]
    assert [step.done for step in steps] == [1, 9, 17, 25, 26]
    assert {step.facts[0] for step in steps} == {"8.0 iterations/s"}


def test_a_terminal_has_a_bar(clock, capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    summary = Progress("x", 2, "rollouts")
    for _ in range(2):
        clock.now += 1.0
        summary.advance(1)
    half, whole = capsys.readouterr().err.split("\r")[1:]
    assert half.startswith(f"x [{'#' * 15}{'-' * 15}] 1/2 rollouts") and "\n" not in half
    assert whole.startswith(f"x [{'#' * 30}] 2/2 rollouts") and whole.endswith("\n")


def test_what_is_told_is_read_back_and_other_lines_are_no_steps() -> None:
    facts = ("generation 0", "best 0.5", "4.0 rollouts/s")
    for step in (
        Step("history-band1-de", 4, 12, "rollouts", facts),
        Step("policy-b-x-second", 0, 1, "steps"),
    ):
        assert parse(f"{step}\n") == step
    for line in ("", "band1 de: loss 0.3", "picture 3 of 9", "x 3/2 rollouts", "x 0/0 rollouts"):
        assert parse(line) is None
    assert parse("1/2 rollouts") is None
