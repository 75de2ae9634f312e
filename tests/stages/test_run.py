"""stages/run.sh finds the Python that has the packages, whoever calls DVC."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.flow.toy import Toy, stage
from tests.project import ROOT

SYSTEM = "/usr/bin:/bin"


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    """A project whose one stage is run as those of dvc.yaml are."""
    toy = Toy(tmp_path / "toy", {"one": stage("sh stages/run.sh one x", "one.out")})
    (toy.folder / "stages").mkdir()
    (toy.folder / "stages/run.sh").write_bytes((ROOT / "stages/run.sh").read_bytes())
    script = "import sys, warp\nopen('one.out', 'w').write(sys.argv[1])\n"
    (toy.folder / "stages/one.py").write_text(script)
    return toy


def repro(toy: Toy, path: str) -> subprocess.CompletedProcess:
    env = toy.environment(PATH=path)
    env.pop("PYTHONPATH", None)
    command = [sys.executable, "-m", "dvc", "repro", "--force"]
    options = {"capture_output": True, "text": True, "timeout": 240}
    return subprocess.run(command, cwd=toy.folder, env=env, **options)


def test_a_stage_runs_where_no_environment_is_active(toy: Toy) -> None:
    """By .venv's Python; one that is active but lacks the packages is passed over."""
    (toy.folder / "bin").mkdir()
    other = toy.folder / "bin/python"
    other.write_text("#!/bin/sh\nexit 1\n")
    other.chmod(0o755)
    (toy.folder / ".venv").symlink_to(sys.prefix)
    for path in (SYSTEM, f"{other.parent}{os.pathsep}{SYSTEM}"):
        done = repro(toy, path)
        assert done.returncode == 0, done.stdout + done.stderr
        assert (toy.folder / "one.out").read_text() == "x"


def test_where_no_python_has_the_packages_one_line_says_so(toy: Toy, tmp_path: Path) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    (tools / "sh").symlink_to("/bin/sh")
    done = subprocess.run(
        ["/bin/sh", "stages/run.sh", "one", "x"],
        cwd=toy.folder,
        env={"PATH": str(tools)},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    start = "error: no Python here has this project's packages ("
    assert done.stderr.startswith(start) and "python: not found" in done.stderr
    assert "): make setup, then" in done.stderr
