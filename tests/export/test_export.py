"""The command and the function, and the plain numbers."""

import json
import shutil
import sys
from functools import partial

import pytest
from ruamel.yaml import YAML

from pipeline.simulator.parameters import THETA
from sling2sim2real import UserError, export
from tests.project import DEFAULTS, python
from validation.projects import CLI


def test_plain_numbers_are_those_of_the_simulation(model, tmp_path) -> None:
    done = export(model, "yaml", tmp_path / "toy")
    assert done.met is None
    content = YAML(typ="safe").load(tmp_path / "toy" / "toy.yaml")
    values = {row["name"]: row for row in content["values"]}
    assert values["youngs_modulus"] | {"value": 2.2e5, "unit": "Pa"} == values["youngs_modulus"]
    assert content["sizes"]["mass_kg"] == 0.023
    assert content["history"] == {"pull_time_s": 4.0, "pause_s": 2.0}
    assert len(content["launches"]) > 8
    for row in content["launches"][::4]:
        ours = model.launches(row["draw_m"])
        assert row["landing_m"] == pytest.approx(ours.landing_y[0], rel=1e-3)
        assert row["hold_force_n"] == pytest.approx(ours.hold_force[0], rel=1e-3)
    curve = dict(zip(*content["curve"].values(), strict=True))
    slope = curve[1.1] / 0.1 / (2.2e5 * 3.14159 * 0.005**2)
    assert curve[1.0] == 0 and 0.8 < slope < 1  # it softens from E A on
    assert json.loads((tmp_path / "toy" / "card.json").read_text()) == done.card


def test_what_it_refuses(model, tmp_path, monkeypatch) -> None:
    with pytest.raises(UserError, match="to: must be one of mjcf, newton, yaml, usd, got 'drake'"):
        export(model, "drake", tmp_path / "toy")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    with pytest.raises(UserError, match="holds something else than an export"):
        export(model, "yaml", tmp_path / "mine")
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(UserError, match=r"mujoco is not installed: make setup"):
        export(model, "mjcf", tmp_path / "toy")
    assert [path.name for path in tmp_path.rglob("*")] == ["mine", "thesis.tex"]


def test_the_command(tmp_path, sling) -> None:
    """With a θ file written by hand; a second run replaces the first."""
    shutil.copy(DEFAULTS, tmp_path)
    theta = tmp_path / "data/theta/band1/least_squares.json"
    theta.parent.mkdir(parents=True)
    soft = dict(zip(THETA, (2.2e5, 0.45, 2e-3, 0.5, 1.0), strict=True))
    theta.write_text(json.dumps({"band": "band1", "theta": soft}))
    command = ("export", "--band", "band1", "--to", "yaml")
    for run in (partial(python, *CLI), sling):
        done = run(*command, folder=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout == "data/exports/band1/yaml: README.md, band1.yaml, card.json\n"
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
