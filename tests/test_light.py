"""The library works without what the extra `run` brings, and says what a command lacks."""

import importlib
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from sling2sim2real.base.errors import EXTRAS
from tests.project import ROOT

DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
NAMED = {"markdown-it-py": "markdown_it", "rsl-rl-lib": "rsl_rl", "scikit-sundae": "sksundae"}
LIGHT = """
import sys
absent = set({absent!r})
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in absent:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
"""
COMMAND = """
import sling2sim2real as s2s
[getattr(s2s, name) for name in s2s.__all__]
from sling2sim2real.cli.cli import main
sys.argv = ["sling", *{words!r}]
main()
"""
SERVER = """
from pathlib import Path
from pipeline.flow import server
from sling2sim2real.base import errors
errors.run(lambda: server.serve(Path.cwd()))
"""


def light(folder: Path, code: str) -> subprocess.CompletedProcess:
    """Code in a folder, by a Python without what the extra `run` brings."""
    script = LIGHT.format(absent=EXTRAS["run"].split()) + code
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", script]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)


def sling(folder: Path, *words: str) -> subprocess.CompletedProcess:
    """A command in a folder, by that Python."""
    return light(folder, COMMAND.format(words=words))


def test_the_messages_know_what_the_extra_brings() -> None:
    for name in (Requirement(line).name for line in DECLARED["run"]):
        module = NAMED.get(name, name.replace("-", "_"))
        assert module in EXTRAS["run"].split()
        assert importlib.util.find_spec(module)


@pytest.mark.slow
def test_a_light_install_suffices_and_says_what_it_lacks(tmp_path: Path) -> None:
    how = "make setup, or pip install '.[run]' -c constraints.txt in the project's folder"
    assert sling(ROOT, "--help").returncode == 0
    assert sling(tmp_path, "check", "no.mcap").stderr.endswith(
        "error: no.mcap: no such file or directory\n"
    )
    lacking = light(ROOT, SERVER)
    assert lacking.returncode == 1
    assert re.fullmatch(rf"error: \w+ is not installed: {re.escape(how)}\n", lacking.stderr)
