"""The stage from θ file to exported policies, on the toy slingshot and a short training."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow.parquet as pq
import pytest
from ruamel.yaml import YAML

from pipeline.base.files import write_json
from pipeline.landing.stored import PLAIN, ROBUST, Stored
from pipeline.policy import robust
from pipeline.sling.material import THETA
from stages import policy
from tests.policy import toy
from tests.project import ROOT

POINT = (2e5, 0.47, 2e-3, 0.5, 0.6)
STORED = Stored("band1", "least_squares")
FOLDER = STORED.folder()
FILES = {"card.json", "policy.onnx", "policy.pt", "training.parquet"}


def launcher(draws: np.ndarray, thetas: np.ndarray | None = None) -> SimpleNamespace:
    """The toy, whose landing goes with Young's modulus."""
    launched = toy.launch(draws)
    if thetas is not None:
        launched.landing_y = launched.landing_y * thetas[:, 0] / POINT[0]
    return launched


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder with parameters for a short training and a θ file; it runs the stage there."""
    monkeypatch.chdir(tmp_path)
    yaml = YAML()
    content = yaml.load(ROOT / "params.yaml")
    content["policy"].update({"envs": 64, "iterations": 12, "map_size": [9, 7]})
    content["policy"]["robust"].update({"samples": 3, "map_size": [7, 5]})
    yaml.dump(content, tmp_path / "params.yaml")
    theta = {"band": "band1", "theta": dict(zip(THETA, POINT, strict=True))}
    for method in ("least_squares", "package_si"):
        write_json(Path(f"data/theta/band1/{method}.json"), theta)
    samples = np.tile(POINT, (20, 1))
    samples[:, 0] *= np.linspace(0.95, 1.05, 20)
    write_json(
        Path("data/confidence/band1/least_squares.json"),
        {"names": list(THETA), "samples": samples.tolist()},
    )

    monkeypatch.setattr(robust, "STEPS", 30)

    def run(method: str = "least_squares", launch=launcher) -> None:
        monkeypatch.setattr(policy, "simulator", lambda *args, **kwargs: launch)
        monkeypatch.setattr(sys, "argv", ["policy.py", "band1", method])
        policy.main()

    return run


def test_both_policies_are_written_with_their_cards(project, capsys) -> None:
    project()
    assert STORED.kinds() == [PLAIN, ROBUST]
    plain, second = (STORED.card(kind) for kind in STORED.kinds())
    assert {file.name for file in FOLDER.iterdir()} == FILES | {"map.parquet", "robust"}
    assert {file.name for file in (FOLDER / "robust").iterdir()} == FILES
    assert (plain["kind"], second["kind"]) == ("plain", "robust")
    targets = np.linspace(1.425, 2.425, 256)
    landing = toy.launch(STORED.draws(targets)).landing_y
    assert plain["training"]["mean_error_m"] == pytest.approx(
        np.abs(landing - targets).mean(), 1e-3
    )
    about = second["training"]
    assert about["expected_error_m"] < about["plain_expected_error_m"] and about["samples"] == 3
    assert not (STORED.draws(targets) == STORED.draws(targets, ROBUST)).all()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 and "robust" in lines[1]
    assert len(pq.read_table(FOLDER / "training.parquet")) == 12
    assert len(pq.read_table(FOLDER / "map.parquet")) == 9 * 7 + 128  # policy.map_size, and checks
    assert not list(Path(".checkpoints/policy").iterdir())


def test_without_confidence_there_is_no_robust_policy(project, capsys) -> None:
    """A θ file by hand has none beside it: to load_samples the same as one without samples."""
    Path("data/confidence/band1/least_squares.json").unlink()
    project()
    assert {file.name for file in FOLDER.iterdir()} == FILES | {"map.parquet"}
    assert "no robust policy, for there are no samples in data/conf" in capsys.readouterr().out


def test_a_method_that_is_not_named_gets_a_plain_one_alone(project, capsys) -> None:
    project("package_si")
    assert not Path("data/policies/band1/package_si/robust").exists()
    assert len(capsys.readouterr().out.splitlines()) == 1


def test_a_theta_whose_launches_all_fail_is_said_not_to_converge(project, capsys) -> None:
    project(launch=toy.broken)
    for line in capsys.readouterr().out.splitlines():
        assert "NOT converged; 256 of 256 targets fail: the simulation did not converge 256" in line
    for kind in (PLAIN, ROBUST):
        told = STORED.card(kind)["training"]
        assert told["converged"] is False and told["mean_error_m"] is None
        assert np.isfinite(STORED.draws(np.array([1.9]), kind)).all()
