"""The command and the function."""

import json
import sys
from functools import partial

import pytest

from sling2sim2real import UserError, export
from tests.cli.lab import fitted
from tests.project import python
from validation.projects import CLI


def test_what_it_refuses(model, tmp_path, monkeypatch) -> None:
    with pytest.raises(UserError, match="to: must be one of mjcf, newton, usd, got 'drake'"):
        export(model, "drake", tmp_path / "toy")
    for to, count, expected in (
        ("usd", 3, "samples: only for mjcf and newton"),
        ("mjcf", 6, "samples: must be from 0 to 5, which the band has, got 6"),
    ):
        with pytest.raises(UserError, match=expected):
            export(model, to, tmp_path / "toy", samples=count)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    with pytest.raises(UserError, match="holds something else than an export"):
        export(model, "usd", tmp_path / "mine")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UserError, match=r"mujoco is not installed: make setup"):
        export(model, "mjcf", tmp_path / "toy")
    assert [path.name for path in tmp_path.rglob("*")] == ["mine", "thesis.tex"]


@pytest.mark.slow
def test_the_command(tmp_path, sling) -> None:
    """Of a band's folder; a second run replaces the first."""
    fitted(tmp_path)
    command = ("export", "bands/toy", "--to", "usd")
    for run in (partial(python, *CLI), sling):
        done = run(*command, folder=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == "bands/toy/exports/usd: README.md, card.json, nodes.json, toy.usda\n"
    done = sling(*command, "--json", "--out", "elsewhere", folder=tmp_path)
    assert json.loads(done.stdout) == json.loads((tmp_path / "elsewhere/card.json").read_text())
    for arguments, expected in (
        (("export", "bands/none", "--to", "usd"), "bands/none"),
        ((*command[:-1], "drake"), "invalid choice: 'drake'"),
    ):
        done = sling(*arguments, folder=tmp_path)
        assert done.returncode and expected in done.stderr and not done.stdout
        assert done.stderr.count("\n") == 1
