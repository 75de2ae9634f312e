"""Parts of what a step takes, of a small project whose stages import and work so much."""

import json
from pathlib import Path

import pytest

from pipeline.base.errors import UserError
from tests.app.flow.toy import Toy, stage
from validation.benchmarks import stages as bench

# It imports one module of pandas' size, lazily, and works for two seconds.
WORK = """
import pathlib, sys, time
def work():
    import heavy
    end = time.process_time() + 2.0
    while time.process_time() < end:
        pass
if sys.argv[1] == "one":
    work()
pathlib.Path(sys.argv[1] + ".out").write_text("x")
"""
HEAVY = "import time\nend = time.process_time() + 0.4\nwhile time.process_time() < end: pass\n"


def test_imports_are_told_from_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    toy = Toy(tmp_path / "toy", {"one": stage("one"), "two": stage("two")}, work=WORK)
    (toy.folder / "heavy.py").write_text(HEAVY)
    toy.dvc("repro")
    monkeypatch.setattr(bench, "HEAVY", ["heavy", "torch"])
    monkeypatch.setenv("DVC_SITE_CACHE_DIR", toy.environment["DVC_SITE_CACHE_DIR"])
    project = bench.Project(toy.folder)
    profile = bench.profile(project, ["one"])
    assert [*profile] == ["one"] and profile["one"]["heavy"] == ["heavy"]
    times = profile["one"]
    # A module of 0.4 s, work of 2 s: CPU times differ by the interpreter's start, here and there.
    assert 0.2 < times["imports_s"] < times["work_s"] and times["dvc_s"] > 0
    assert 0 < times["interpreter_s"]
    with pytest.raises(UserError, match="--steps three: there are one, two"):
        bench.profile(project, ["three"])


def test_one_side_leaves_the_other(tmp_path: Path) -> None:
    path = tmp_path / "stages.json"
    path.write_text(json.dumps(bench.updated(path, "before", {"steps": {"a": 1}}, "x")))
    report = bench.updated(path, "after", {"steps": {"b": 2}}, "y")
    assert report["before"] == {"steps": {"a": 1}} and report["after"] == {"steps": {"b": 2}}
    assert report["command"] == "y"
