"""Lines of long things: that they are read back, and that they are not too many."""

from types import SimpleNamespace

import pytest

from sling2sim2real.base import progress
from sling2sim2real.base.progress import Progress, Step, parse


def test_lines_are_told_no_more_often_than_asked_but_the_last_is(
    tmp_path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    """In one second of a clock that is set; each line says rate and time left."""
    monkeypatch.chdir(tmp_path)
    now = [100.0]
    clock = SimpleNamespace(monotonic=lambda: now[0], strftime=lambda form: form)
    monkeypatch.setattr(progress, "time", clock)
    summary = Progress("x", 26, "iterations", every=1.0)
    for _ in range(26):
        now[0] += 0.125
        summary.advance(1)
    steps = [parse(line) for line in capsys.readouterr().err.splitlines()]
    assert [step.done for step in steps] == [1, 9, 17, 25, 26]
    assert {step.facts[0] for step in steps} == {"8.0 iterations/s"}
    assert steps[1].facts[1] == "0:02 left"
    assert len((tmp_path / "logs/x.log").read_text().splitlines()) == 6


def test_what_is_told_is_read_back_and_other_lines_are_no_steps() -> None:
    facts = ("generation 0", "best 0.5", "4.0 rollouts/s")
    step = Step("history-band1-de", 4, 12, "rollouts", facts)
    assert parse(f"{step}\n") == step
    for line in ("", "band1 de: loss 0.3", "picture 3 of 9", "x 3/2 rollouts", "x 0/0 rollouts"):
        assert parse(line) is None
