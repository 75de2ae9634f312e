"""The exported files against the trained network, in processes that know nothing of us."""

import json
import os
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from pipeline.params import load
from sling2sim2real.base.files import write_json
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.export import USED, card, write_onnx
from sling2sim2real.simulator.parameters import THETA
from tests.golden import expect_golden
from tests.policy import toy
from tests.project import DEFAULTS, ROOT, python

TARGETS = np.random.default_rng(0).uniform(1.425, 2.425, (1000, 1)).astype(np.float32)


@pytest.fixture(scope="module")
def stored(trained, tmp_path_factory):
    stored = Stored(tmp_path_factory.mktemp("policy"))
    write_onnx(trained.policy, stored.folder / "policy.onnx")
    return stored


@pytest.fixture(scope="module")
def folder(stored):
    return stored.folder


def apart(code: str, folder: Path, **environment: str) -> str:
    """What another process prints that runs `code` in `folder`, with the project out of reach."""
    done = python("-c", code, folder=folder, **{"PYTHONPATH": "", **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout


def answers(policy, folder: Path, **given: np.ndarray) -> np.ndarray:
    """What the ONNX file answers to its inputs, as the network does to 1e-5 m."""
    with torch.inference_mode():
        network = policy(**{name: torch.from_numpy(array) for name, array in given.items()}).numpy()
    session = onnxruntime.InferenceSession(folder / "policy.onnx")
    assert [port.name for port in session.get_inputs()] == list(given)
    graph = session.run(["draw"], given)[0]
    assert network.shape == graph.shape == (1000, 2)
    np.testing.assert_allclose(graph, network, rtol=0, atol=1e-5)
    return graph


def test_onnx_agrees_with_the_network(trained, stored, folder) -> None:
    """On 1,000 targets to 1e-5 m; and it is a network that has learned to hit."""
    graph = answers(trained.policy, folder, target=TARGETS)
    np.testing.assert_array_equal(stored.draws(TARGETS[:, 0]), graph.astype(float))
    landing = toy.launch(graph.astype(float)).landing_y
    assert np.abs(landing - TARGETS[:, 0]).mean() < 0.02


def test_a_policy_that_sees_the_projectile_agrees_too(seeing, tmp_path) -> None:
    """With positions other than the one it was trained at: the input is one."""
    stored = Stored(tmp_path / "policy")
    write_onnx(seeing.policy, stored.folder / "policy.onnx")
    write_json(stored.folder / "card.json", written(seeing, FIGURES))
    onnx.checker.check_model(onnx.load(stored.folder / "policy.onnx"), full_check=True)
    random = np.random.default_rng(1)
    places = random.uniform((-0.2, -0.3), (0.1, -0.1), (1000, 2)).astype(np.float32)
    graph = answers(seeing.policy, stored.folder, projectile=places, target=TARGETS)
    draws = stored.draws(TARGETS[:, 0])
    np.testing.assert_allclose(draws, seeing.policy.draws(TARGETS[:, 0]), rtol=0, atol=1e-5)
    assert np.abs(draws - graph).max() > 1e-3  # so the position counts


def test_one_file_without_paths(folder) -> None:
    (file,) = folder.iterdir()
    onnx.checker.check_model(onnx.load(file), full_check=True)
    for path in (b"site-packages", os.fsencode(ROOT)):
        assert path not in file.read_bytes()


def test_the_example_asks_a_policy_where_this_project_is_not(trained, stored, tmp_path) -> None:
    """With onnxruntime and NumPy alone; it reads units, frames and limits off the card."""
    files = stored.folder / "policy.onnx", ROOT / "examples" / "policy_elsewhere.py"
    for file in files:
        (tmp_path / file.name).write_bytes(file.read_bytes())
    content = written(trained, {**FIGURES, "converged": False})
    content["launch"] = {"pull_time_s": 4.0, "pause_s": 2.0}
    (tmp_path / "card.json").write_text(json.dumps(content))
    code = """
import runpy, sys
ours = "app", "examples", "pipeline", "sling2sim2real", "stages", "tests", "torch", "onnx"
sys.modules |= dict.fromkeys(ours)  # whoever imports one of them fails
sys.argv = ["policy_elsewhere.py", ".", "2.6"]
runpy.run_path("policy_elsewhere.py", run_name="__main__")
"""
    message = apart(code, tmp_path)
    y, z = stored.draws(np.array([2.6]))[0]
    assert message.startswith(f"draw to y = {y:.3f} m, z = {z:.3f} m\n")
    assert "frame: origin midway between the fork tips, y towards the target, z up" in message
    assert "trained for targets from 1.425 to 2.425 m" in message and "did not converge" in message
    assert "the arm may hold 30 N" in message and "draw in 4.0 s, wait 2.0 s" in message


FIGURES = {
    "converged": True,
    "criterion": "mean |y_p - g| <= 0.01 m over 256 targets, no failure",
    "iteration": 37,
    "iterations": 60,
    "mean_error_m": np.float64(0.004),
    "max_error_m": np.float32(0.011),
    "failed_targets": np.int64(0),
    "map_mean_error_m": 0.004,
    "failed_launches": {"holding force above the limit": 12},
}


def written(trained, training: dict, **theta) -> dict:
    """A card of band1 as a reader of the file finds it."""
    params = load(DEFAULTS)
    content = {"theta": dict.fromkeys(THETA, 0.4), **theta}
    made = card(trained.policy, params, "band1", "ours", content, training=training)
    return json.loads(json.dumps(made, allow_nan=False))


def test_the_card_is_the_committed_one(seeing) -> None:
    """Of a policy that sees the projectile, in the air; versions and settings change."""
    content = written(seeing, FIGURES, nuisances={"air_drag": 2.5})
    versions, settings = content.pop("versions"), content.pop("made_with")
    assert versions["torch"] == torch.__version__.partition("+")[0] and len(versions) == len(USED)
    assert settings["setup"]["fork_width"] == 0.275
    expect_golden(json.dumps(content, indent=2) + "\n", Path(__file__).parent / "golden/card.json")
