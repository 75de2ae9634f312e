"""The stage from θ file to exported policy, on the toy slingshot and a short training."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from sling2sim2real.base.files import write_json
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.simulator.parameters import THETA
from stages import policy
from tests.policy import toy
from tests.project import DEFAULTS

POINT = (2e5, 0.47, 2e-3, 0.5, 0.6)
STORED = Stored(Path("data/policies/band1-posterior"))
FOLDER = STORED.folder


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder with parameters for a short training and a θ file; it runs the stage there."""
    monkeypatch.chdir(tmp_path)
    yaml = YAML()
    content = yaml.load(DEFAULTS)
    content["policy"].update({"envs": 64, "iterations": 12, "map_size": [9, 7]})
    theta = {"band": "band1", "theta": dict(zip(THETA, POINT, strict=True))}
    write_json(Path("data/theta/band1-posterior.json"), theta)

    def run(launch=toy.launch, **changes) -> None:
        content["policy"].update(changes)
        yaml.dump(content, tmp_path / "params.yaml")
        monkeypatch.setattr(policy, "simulator", lambda *args, **kwargs: launch)
        monkeypatch.setattr(sys, "argv", ["policy.py", "band1-posterior"])
        policy.main()

    return run


def test_a_theta_whose_launches_all_fail_is_said_not_to_converge(project, capsys) -> None:
    project(launch=toy.broken)
    (line,) = capsys.readouterr().out.splitlines()
    assert "NOT converged; 256 of 256 targets fail: the simulation did not converge 256" in line
    summary = STORED.card()["training"]
    assert summary["converged"] is False and summary["mean_error_m"] is None
    assert np.isfinite(STORED.draws(np.array([1.9]))).all()


USUAL = {"landings": "map", "exploration": "scheduled", "state": "target"}
PRINTED = {"landings": "simulated", "exploration": "learned", "state": "projectile_target"}


@pytest.mark.slow
def test_as_the_paper_prints_it(project) -> None:
    """Each switch alone gives another policy; all at once, one with an honest card."""
    project()
    networks = {(FOLDER / "policy.onnx").read_bytes()}
    assert "projectile" not in json.loads((FOLDER / "card.json").read_text())
    for name, value in PRINTED.items():
        project(**(USUAL | {name: value}))
        networks.add((FOLDER / "policy.onnx").read_bytes())
    assert len(networks) == 4
    project(**PRINTED)
    content = json.loads((FOLDER / "card.json").read_text())
    assert content["projectile"]["trained_at"] == [0.0, -0.220667]  # (0.26² - 0.1375²)^½
    assert content["training"]["map_mean_error_m"] is None
    assert content["training"]["mean_error_m"] is not None
    assert np.isfinite(STORED.draws(np.array([1.9]))).all()
