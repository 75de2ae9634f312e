"""The guard where others do not do as they should: process 1, the loader, the guard itself."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.flow import child, guard
from tests.project import alive, python, until

# Orphans go to the nearest subreaper; here to one that looks at none of them but the guard.
OUTER = """\
import ctypes, os, subprocess, sys
ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)
started = subprocess.Popen(sys.argv[1:], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)
status = started.wait()
try:
    dead, _ = os.waitpid(-1, os.WNOHANG)
except ChildProcessError:
    dead = None
print(status, dead)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux knows subreapers")
def test_the_guard_reaps_what_its_command_leaves() -> None:
    """Zombies count as members of the group: each stage would cost the whole grace."""
    command = [sys.executable, guard.__file__, "sh", "-c", "sleep 600 & sleep 601 & exit 5"]
    done = python("-c", OUTER, *command)
    assert done.stdout == "5 None\n", done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells children of a parent's death")
def test_a_command_is_interrupted_where_its_guard_is_killed() -> None:
    """As Prefect's server, of which nobody else knows the number."""
    command = [sys.executable, guard.__file__, "sleep", "602"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    number = int(process.stdout.readline())
    process.kill()
    process.communicate()
    until(lambda: not alive(number))


def test_the_loaders_own_lines_come_before_the_groups_number(tmp_path: Path) -> None:
    environment = {**os.environ, "LD_PRELOAD": str(tmp_path / "missing.so")}
    command = ["sh", "-c", "exit 3"]
    with child._guarded(command, tmp_path, environment, lambda: False) as process:
        process.stdout.read()
    assert process.returncode == 3


def test_a_guard_that_says_no_number_leaves_nothing(tmp_path, monkeypatch) -> None:
    mute = tmp_path / "mute.py"
    mute.write_text("import sys\nprint('no number', flush=True)\nsys.stdin.read()\n")
    monkeypatch.setattr(guard, "__file__", str(mute))
    requested = iter(range(3))
    with child._guarded(
        ["true"], tmp_path, os.environ, lambda: next(requested, None) is None
    ) as process:
        assert process.stdout.read() == ""
    assert process.returncode == 0
