"""Commands that run a module of a checkout, with their arguments as given."""

import os
import sys

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli import checkout


def test_each_runs_its_module_in_the_projects_folder_and_elsewhere_is_refused(
    tmp_path, monkeypatch
) -> None:
    """From any folder below; the process becomes another one, which `execv` never leaves."""
    started = []

    def execv(*given) -> None:
        started.append((os.getcwd(), *given))
        raise SystemExit

    monkeypatch.setattr(os, "execv", execv)
    inner = tmp_path / "project/reports/bands"
    inner.mkdir(parents=True)
    (tmp_path / "project/dvc.yaml").touch()
    for command, (module, *_) in checkout.COMMANDS.items():
        monkeypatch.chdir(inner)
        with pytest.raises(SystemExit):
            checkout.run(command, ["--workers", "2"])
        arguments = [sys.executable, "-m", module, "--workers", "2"]
        assert started.pop() == (str(tmp_path / "project"), sys.executable, arguments)
    with pytest.raises(UserError, match="sling flow: needs a checkout of the project: no dvc.yaml"):
        checkout.run("flow", [], tmp_path)
