"""Times of steps: what is measured of a command, what is kept, and what stands in docs/times.md."""

import json
import sys
from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli.cli import parser
from tests.project import write_files
from validation.benchmarks import times as bench
from validation.benchmarks.times import MeasuredStep
from validation.benchmarks.timing import disk, measured
from validation.projects import ProjectCopy

HUNDRED_MB = "import time; held = b'1' * 100_000_000; time.sleep({seconds})"
AMONG_CHILDREN = f"""
import subprocess, sys
subprocess.run([sys.executable, "-c", {HUNDRED_MB.format(seconds=0.6)!r}], check=True)
"""


def step(name: str, code: str, **options) -> MeasuredStep:
    return MeasuredStep(name, f"`{name}`", (sys.executable, "-c", code), **options)


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


def test_each_row_measures_a_command_that_there_is(tmp_path: Path) -> None:
    for row in bench.steps(tmp_path / "mine.mcap", 0.04):
        if row.command[0].endswith("sling"):
            parser().parse_args(row.command[1:])  # exits where it cannot be understood


def test_steps_are_measured_once_and_failures_again(tmp_path: Path) -> None:
    root, folder = tmp_path / "project", tmp_path / "kept"
    write_files(root, {"a": ""})
    ProjectCopy(root).commit()
    todo = [
        step("setup", "open('../count', 'a').write('1'); open('venv', 'w').write('1' * 10000)",
             makes=("venv",)),
        step("run", "import os; print('1 ran' if os.path.exists('mended') else '0 ran')",
             says="[1-9] ran"),
    ]  # fmt: skip
    with pytest.raises(UserError, match="run: status 0: 0 ran; all of it: .*run.log"):
        bench.times(todo, folder, root, "a command")
    assert not (root / bench.REPORT).exists()
    (folder / "project/mended").touch()
    report = bench.times(todo, folder, root, "a command")
    assert (folder / "count").read_text() == "1"  # setup's is kept
    assert json.loads((root / bench.REPORT).read_text()) == report
    assert report["steps"][0]["disk_bytes"]["venv"] >= 10000
    assert bench.table(report)[-1].startswith("| `run` | 0 s |")
