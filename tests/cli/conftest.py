"""Commands, without a process of their own: Python and what it imports take seconds to start."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sling2sim2real.cli import cli


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
