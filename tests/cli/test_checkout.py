"""Commands that run a module of a checkout, with their arguments as given."""

import importlib
import os
import sys

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.cli import checkout
from tests.project import ROOT


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


@pytest.mark.parametrize(
    ("module", "line", "attribute", "value"),
    [
        ("pipeline.flow.__main__", "theta@band1 --workers 2", "targets", ["theta@band1"]),
        ("pipeline.flow.__main__", "--workers 2", "workers", 2),
        ("pipeline.flow.__main__", "--dask tcp://10.0.0.5:8786", "dask", "tcp://10.0.0.5:8786"),
        ("pipeline.flow.server", "--port 4201", "port", 4201),
        ("validation.verify", "--device cuda:0", "device", "cuda:0"),
        ("validation.bench", "--law rubber", "law", "rubber"),
        ("validation.bench", "--json", "json", True),
    ],
)
def test_their_options_are_understood(module, line, attribute, value) -> None:
    parsed = importlib.import_module(module).parser().parse_args(line.split())
    assert getattr(parsed, attribute) == value


def test_each_command_has_its_module() -> None:
    for module, _ in checkout.COMMANDS.values():
        place = ROOT.joinpath(*module.split("."))
        assert place.with_suffix(".py").is_file() or (place / "__main__.py").is_file()
