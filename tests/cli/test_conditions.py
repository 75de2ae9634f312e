"""What a user may meet: a project that cannot be written, a full disk, a ZIP, code like ours."""

import os
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from dvc.config import Config

from sling2sim2real.base.disk import expect_ready
from sling2sim2real.base.errors import UserError
from tests.project import DEFAULTS, python
from validation.projects import SLING, environment

# Root writes what is marked read-only, but for this.
WITHOUT_POWER = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """As much of a project as commands look at first."""
    folder = tmp_path / "project"
    (folder / ".dvc/tmp").mkdir(parents=True)
    (folder / "params.yaml").write_bytes(DEFAULTS.read_bytes())
    subprocess.run(["git", "init", "-q"], cwd=folder, check=True)
    return folder


@pytest.mark.parametrize(
    "words",
    [
        "fit seen.mcap --name new --mass 0.023",
        "observe bands/toy --draw=-0.30,-0.15 --landing 1.85",
        "setup --max-force 40",
        "plan bands/toy",
    ],
)
def test_a_folder_that_may_not_be_written_is_refused_in_one_line(copied: Path, words: str) -> None:
    prefix = WITHOUT_POWER if os.geteuid() == 0 else ()
    for path in (*copied.rglob("*"), copied):
        path.chmod(path.stat().st_mode & ~0o222)
    before = {path: path.stat().st_mtime_ns for path in copied.rglob("*")}
    variables = environment(TMPDIR="/tmp", PYTHONDONTWRITEBYTECODE="1", HOME="/")
    command, options = [*prefix, *SLING, *words.split()], {"capture_output": True, "text": True}
    done = subprocess.run(command, cwd=copied, env=variables, timeout=240, **options)
    assert (done.returncode, done.stdout) == (1, ""), done.stderr
    line = done.stderr.splitlines()[-1]
    assert line.startswith("error: ") and "may not be read or written here" in line
    assert "Traceback" not in done.stderr
    assert {path: path.stat().st_mtime_ns for path in copied.rglob("*")} == before


def test_a_project_without_git_is_told_to_dvc(project: Path) -> None:
    """It was unpacked from a ZIP: DVC would refuse, once data are there."""
    expect_ready(project)
    assert not (project / ".dvc/config.local").exists()
    subprocess.run(["rm", "-rf", project / ".git"], check=True)
    expect_ready(project)
    expect_ready(project)
    assert Config(str(project / ".dvc"))["core"]["no_scm"] is True


def test_a_full_disk_is_told_before_anything_changes(project: Path, monkeypatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda folder: SimpleNamespace(free=0))
    with pytest.raises(UserError, match="cannot be written .No space left on device"):
        expect_ready(project)


def test_the_help_of_a_stream_that_has_no_theta() -> None:
    done = python("-m", "sling2sim2real", "launch", "--help", PYTHONIOENCODING="ascii:strict")
    assert (done.returncode, done.stderr) == (0, "") and "\\u03b8 file" in done.stdout
