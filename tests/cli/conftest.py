"""Commands, without a process of their own: Python and what it imports take seconds to start."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sling2sim2real.cli import cli
from tests import once
from tests.cli import lab


@pytest.fixture
def sling(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture) -> Callable:
    """Runs a command in this process, in a folder, and gives what subprocess.run would."""

    def run(*arguments: str, folder: Path) -> subprocess.CompletedProcess:
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["sling", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return subprocess.CompletedProcess(
            arguments, int(ended.value.code or 0), *capsys.readouterr()
        )

    return run


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lab whose band `toy` is fitted; to be read only."""
    return once.folder(tmp_path_factory, "lab", lab.fitted)


@pytest.fixture
def copied(fitted: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy, to change, as the working folder."""
    shutil.copytree(fitted, tmp_path / "lab")
    monkeypatch.chdir(tmp_path / "lab")
    return tmp_path / "lab"
