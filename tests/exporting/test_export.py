"""The command and the function."""

import json
import shutil
import sys
from functools import partial

import pytest

from sling2sim2real import UserError, export
from sling2sim2real.simulator.parameters import THETA
from tests.project import DEFAULTS, python
from validation.projects import CLI


def test_what_it_refuses(model, tmp_path, monkeypatch) -> None:
    with pytest.raises(UserError, match="to: must be one of mjcf, newton, usd, got 'drake'"):
        export(model, "drake", tmp_path / "toy")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    with pytest.raises(UserError, match="holds something else than an export"):
        export(model, "usd", tmp_path / "mine")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UserError, match=r"mujoco is not installed: make setup"):
        export(model, "mjcf", tmp_path / "toy")
    assert [path.name for path in tmp_path.rglob("*")] == ["mine", "thesis.tex"]


def test_the_command(tmp_path, sling) -> None:
    """With a θ file written by hand; a second run replaces the first."""
    shutil.copy(DEFAULTS, tmp_path)
    theta = tmp_path / "data/theta/band1/posterior.json"
    theta.parent.mkdir(parents=True)
    soft = dict(zip(THETA, (2.2e5, 0.45, 2e-3, 0.5, 1.0), strict=True))
    theta.write_text(json.dumps({"band": "band1", "theta": soft}))
    command = ("export", "--band", "band1", "--to", "usd")
    for run in (partial(python, *CLI), sling):
        done = run(*command, folder=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert (
            done.stdout == "data/exports/band1/usd: README.md, band1.usda, card.json, nodes.json\n"
        )
    done = sling(*command, "--json", "--out", "elsewhere", folder=tmp_path)
    assert json.loads(done.stdout) == json.loads((tmp_path / "elsewhere/card.json").read_text())
    for arguments, expected in (
        (("--band", "band9"), "band band9: not in params.yaml"),
        (("--method", "de"), "de.json: missing"),
        (("--to", "drake"), "invalid choice: 'drake'"),
    ):
        done = sling(*command, *arguments, folder=tmp_path)
        assert done.returncode and expected in done.stderr and not done.stdout
        assert done.stderr.count("\n") == 1
