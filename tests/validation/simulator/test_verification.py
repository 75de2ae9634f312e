"""The report says what is kept and what is not, and why something was not run."""

import math

import pytest

from sling2sim2real.base.errors import UserError
from validation import verify as report
from validation.simulator.finding import Measure, Theme, off

KEPT = Measure("pull", "closed form", 0.2, "%", 0.5, "16 pairs")
MISSED = Measure("beam", "Euler–Bernoulli", 3.4, "%", 3.0)


def test_a_check_is_met_within_its_limit_and_never_without_a_number():
    assert KEPT.met and not MISSED.met
    assert not Measure("x", "y", math.nan, "%", 1.0).met
    assert math.isnan(off([1.0, math.nan], [1.0, 1.0]))
    assert off([1.01, 0.98], [1.0, 1.0]) == pytest.approx(2.0)


def test_the_report(bench, tmp_path, monkeypatch):
    def missing(_):
        raise UserError("mujoco is not installed")

    sections = {
        "one": lambda _: Theme("One", [KEPT], "Text."),
        "Against MuJoCo": missing,
        "other": lambda _: Theme("Other", [MISSED]),
    }
    monkeypatch.setattr(report, "SECTIONS", sections)
    lines = []
    done = report.verify(bench.params, progress=lines.append, root=tmp_path)
    text = (tmp_path / "reports/simulator.md").read_text("utf-8")
    assert "| pull | 0.2 % | ≤ 0.5 % | yes | closed form | 16 pairs |" in text
    assert "| beam | 3.4 % | ≤ 3 % | **no** |" in text
    assert "## Against MuJoCo\n\nNot run: mujoco is not installed." in text
    assert "1 of 2 limits are kept" in text
    assert "  not met: beam: 3.4 %, limit ≤ 3 %" in lines
    summary, missed = report.summary(done)
    assert missed == 1 and "1 of 2 limits kept" in summary
    assert "not run: Against MuJoCo: mujoco is not installed" in summary


def test_unknown_device_is_refused(bench, tmp_path):
    with pytest.raises(UserError, match="cuda:7"):
        report.verify(bench.params, "cuda:7", root=tmp_path)
    assert not list(tmp_path.iterdir())
