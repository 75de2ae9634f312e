"""Commands that run a module of a checkout, with their arguments as given."""

import os
import sys

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli import checkout


class Replaced(Exception):
    """The process would be another one now."""


@pytest.fixture
def started(monkeypatch: pytest.MonkeyPatch) -> list:
    given = []

    def execv(program: str, arguments: list[str]) -> None:
        given.extend([os.getcwd(), program, arguments])
        raise Replaced

    monkeypatch.setattr(os, "execv", execv)
    return given


@pytest.mark.parametrize("command", checkout.COMMANDS)
def test_it_runs_the_module_in_the_projects_folder(command, started, tmp_path, monkeypatch) -> None:
    inner = tmp_path / "reports" / "bands"
    inner.mkdir(parents=True)
    (tmp_path / "dvc.yaml").touch()
    monkeypatch.chdir(inner)
    with pytest.raises(Replaced):
        checkout.run(command, ["--workers", "2"])
    module = checkout.COMMANDS[command][0]
    assert started == [
        str(tmp_path), sys.executable, [sys.executable, "-m", module, "--workers", "2"]
    ]  # fmt: skip


def test_elsewhere_it_is_refused(tmp_path) -> None:
    with pytest.raises(UserError, match="sling flow: needs a checkout of the project: no dvc.yaml"):
        checkout.run("flow", [], tmp_path)
