"""Times of steps: what is measured of a command, what is kept, and what stands in docs/times.md."""

import json
import sys
from pathlib import Path

import pytest

from app.cli import parser
from pipeline.base.errors import UserError
from tests.project import ROOT, write_files
from validation.benchmarks import times as bench
from validation.benchmarks.times import BEGIN, END, MeasuredStep
from validation.benchmarks.timing import disk, measured
from validation.marked import with_block
from validation.projects import ProjectCopy

HUNDRED_MB = "import time; held = b'1' * 100_000_000; time.sleep({seconds})"
AMONG_CHILDREN = f"""
import subprocess, sys
subprocess.run([sys.executable, "-c", {HUNDRED_MB.format(seconds=0.6)!r}], check=True)
"""
LOG = """\
record-band1 | done (1 min 4 s)
record@band1 | done (1 min 4 s)
record@band2 | done (58.0 s)
ablation_theta@band1-de | done (7.5 s)
theta@band1-sling2sim2real | done (8.5 s)
theta@band2-de | taken from the cache (3.0 s)
floor@band1 | begins
"""


def step(name: str, code: str, **options) -> MeasuredStep:
    return MeasuredStep(name, f"`{name}`", (sys.executable, "-c", code), **options)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """What times.py wants of a project, under Git."""
    root = tmp_path / "project"
    files = {
        "docs/times.md": f"# Times\n\n{BEGIN}old\n{END}\nMore.\n",
        "pipeline/simulator/solver.py": "",
        "stages/record.py": "import pipeline.simulator.solver\n",
        "app/cli.py": "",
    }
    write_files(root, files)
    ProjectCopy(root).commit()
    return root


def test_a_command_has_a_status_times_and_the_memory_of_its_children(tmp_path: Path) -> None:
    log = tmp_path / "log"
    words = [sys.executable, "-c", AMONG_CHILDREN]
    result = measured(words, tmp_path, bench.surroundings(tmp_path), log, every=0.05)
    assert result["status"] == 0 and result["seconds"] >= 0.6
    assert 1e8 < result["peak_memory_bytes"] < 2e8
    work = "import time\nwhile time.process_time() < 0.5: pass\nprint('said')\nraise SystemExit(3)"
    words = [sys.executable, "-c", work]
    result = measured(words, tmp_path, bench.surroundings(tmp_path), log, every=0.05)
    assert result["status"] == 3 and log.read_text() == "said\n"
    assert result["cpu_seconds"] >= 0.5 and 0 <= result["others_share"] <= 1


def test_the_disk_counts_a_file_with_two_names_once(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a/one").write_bytes(b"1" * 1_000_000)
    (tmp_path / "a/two").hardlink_to(tmp_path / "a/one")
    assert 1e6 <= disk(tmp_path / "a") < 1.1e6
    assert disk(tmp_path / "none") == 0


def test_seconds_of_stages_are_of_those_that_ran() -> None:
    assert bench.seconds_of_stages(LOG) == {
        "record": {"count": 2, "median_s": 61.0, "most_s": 64.0},
        "theta": {"count": 2, "median_s": 8.0, "most_s": 8.5},
    }


def test_seconds_of_a_fit_are_those_of_its_log(tmp_path: Path) -> None:
    for number, (command, stages) in enumerate((
        ("sling fit", {"record@band1": 44.6, "own_episode@timed": 14.2, "own_card@timed": 0.2}),
        ("sling flow", {"record@band1": 99.0, "theta@band1-de": 99.0}),
    )):  # fmt: skip
        at, lines = 1000.0, [{"at": 1000.0, "what": "begins", "command": command}]
        for name, seconds in stages.items():
            lines.append({"at": at, "what": "stage", "stage": name, "producers": []})
            at += seconds
            lines.append({"at": at, "what": "ended", "stage": name, "state": "ran"})
        lines.append({"at": at, "what": "ended", "state": "ran"})
        path = tmp_path / "logs/runs" / f"{number}.jsonl"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    assert bench.seconds_of_fit(tmp_path) == {"record": 45, "episode": 14, "card": 1}
    assert bench.seconds_of_fit(tmp_path / "none") == {}


def test_each_row_measures_a_command_that_there_is(tmp_path: Path) -> None:
    steps = {row.name: row for row in bench.steps(tmp_path / "mine.mcap", 0.04)}
    for row in steps.values():
        if row.command[0].endswith("sling"):
            parser().parse_args(row.command[1:])  # exits where it cannot be understood
        assert not row.needs or list(steps).index(row.needs) < list(steps).index(row.name)


def test_steps_are_measured_once_and_failures_again(project: Path, tmp_path: Path) -> None:
    folder, count = tmp_path / "kept", "open('../count', 'a').write('1')"
    todo = [
        step("setup", f"{count}; print('made'); open('venv', 'w').write('1' * 10000)",
             says="made", makes=("venv",)),
        step("run", "import os; os.path.exists('mended') or 1 / 0", needs="setup"),
        step("again", count, needs="run"),
        step("fit", count, needs="setup"),
        step("test", "print('0 ran')", says="[1-9] ran", needs="setup"),
    ]  # fmt: skip
    report = bench.times(todo, folder, project, {"fit": "no recording"}, "a command")
    assert not report["met"] and (folder / "count").read_text() == "1"
    steps = report["steps"]
    assert [name for name in steps if steps[name]["ok"]] == ["setup"]
    assert "ZeroDivisionError" in steps["run"]["why"]
    assert steps["again"]["why"] == "needs run" and steps["fit"]["skipped"] == "no recording"
    assert steps["test"]["why"] == "status 0: 0 ran"  # it did not do what it is timed for
    page = (project / "docs/times.md").read_text()
    assert page.startswith(f"# Times\n\n{BEGIN}") and page.endswith(f"{END}\nMore.\n")
    assert "`run` | failed: status 1: ZeroDivisionError" in page and "old" not in page
    (folder / "project/mended").touch()
    report = bench.times(todo[:4], folder, project, {"fit": "no recording"}, "a command")
    assert report["met"] and (folder / "count").read_text() == "11"  # setup's is kept
    written = json.loads((project / bench.REPORT).read_text())
    assert bench.table(written) == bench.table(report)
    assert (project / "docs/times.md").read_text().count(bench.table(written)) == 1
    assert written["steps"]["setup"]["disk_bytes"]["venv"] >= 10000
    assert set(written["code"]) == {"app/cli.py", "pipeline/simulator", "stages/record.py"}
    assert ProjectCopy(project)("git", "rev-parse", "HEAD").startswith(written["commit"])


def test_a_page_without_marks_is_refused() -> None:
    with pytest.raises(UserError, match="has not one <!-- times: begin -->"):
        with_block("# Times\n", f"{BEGIN}{END}")


def test_the_table_of_the_docs_is_that_of_the_measurement() -> None:
    page = (ROOT / bench.PAGE).read_text(encoding="utf-8")
    assert with_block(page, f"{BEGIN}{END}")  # it has the marks
    if not (ROOT / bench.REPORT).is_file():
        pytest.skip("not measured")
    report = json.loads((ROOT / bench.REPORT).read_text(encoding="utf-8"))
    assert bench.table(report) in page
