"""The exported files against the trained network."""

from __future__ import annotations

import json

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from pipeline.policy.export import card, write_onnx, write_torchscript

TARGETS = np.linspace(1.425, 2.425, 1000, dtype=np.float32)[:, None]


@pytest.fixture(scope="module")
def folder(trained, tmp_path_factory):
    folder = tmp_path_factory.mktemp("policy")
    write_onnx(trained.policy, folder / "policy.onnx")
    write_torchscript(trained.policy, folder / "policy.pt")
    return folder


def test_onnx_and_torchscript_agree_with_the_network(trained, folder) -> None:
    with torch.inference_mode():
        network = trained.policy(torch.from_numpy(TARGETS)).numpy()
        script = torch.jit.load(folder / "policy.pt")(torch.from_numpy(TARGETS)).numpy()
    session = onnxruntime.InferenceSession(folder / "policy.onnx")
    graph = session.run(["draw"], {"target": TARGETS})[0]
    assert network.shape == (1000, 2) and np.ptp(network[:, 0]) > 1e-3
    np.testing.assert_allclose(script, network, atol=1e-5)
    np.testing.assert_allclose(graph, network, atol=1e-5)


def test_any_batch_size(folder) -> None:
    session = onnxruntime.InferenceSession(folder / "policy.onnx")
    script = torch.jit.load(folder / "policy.pt")
    for count in (1, 7):
        assert session.run(None, {"target": TARGETS[:count]})[0].shape == (count, 2)
        assert script(torch.from_numpy(TARGETS[:count])).shape == (count, 2)


def test_one_file_each_without_paths(folder) -> None:
    assert sorted(file.name for file in folder.iterdir()) == ["policy.onnx", "policy.pt"]
    onnx.checker.check_model(onnx.load(folder / "policy.onnx"), full_check=True)
    for file in folder.iterdir():
        assert b"site-packages" not in file.read_bytes()


def test_the_card_tells_units_and_is_strict_json(trained) -> None:
    content = card(
        trained,
        band="toy",
        method="none",
        theta={"youngs_modulus": 1e5},
        targets=(1.425, 2.425),
        max_force=15.0,
        map_error={},
    )
    again = json.loads(json.dumps(content, allow_nan=False))
    assert again["input"]["unit"] == again["output"]["unit"] == "m"
    assert again["output"]["low"] == [-0.45, -0.3] and again["output"]["high"] == [-0.25, -0.1]
    assert again["training"]["converged"] is True
    assert set(again["versions"]) == {"torch", "rsl-rl-lib", "onnx", "numpy"}
