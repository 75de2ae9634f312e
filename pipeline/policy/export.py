"""Write a trained policy as ONNX and TorchScript, with a JSON card that says what it is.

Both files take targets in metres, shape (batch, 1), and give draws in metres, shape (batch, 2): the
normalisation is inside. Equal networks give equal bytes, so the cache sees when nothing changed.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from torch import nn

from pipeline.files import replacing
from pipeline.policy.train import CHECKED_TARGETS, CONVERGED, Policy, Trained

OPSET, IR_VERSION = 18, 10  # any onnxruntime from 1.18 (2024) on reads these
INPUT, OUTPUT = "target", "draw"


def write_onnx(policy: Policy, path: Path) -> None:
    """Write the policy as one self-contained ONNX file with a free batch size.

    The graph is spelled out, because torch's exporter puts the weights into a second file and the
    paths of this machine into the first.
    """
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    nodes, weights = [], []

    def tensor(name: str, values: torch.Tensor) -> str:
        weights.append(numpy_helper.from_array(values.detach().numpy(), name))
        return name

    def node(kind: str, *inputs: str, **attributes) -> str:
        name = f"{kind.lower()}_{len(nodes)}"
        nodes.append(helper.make_node(kind, list(inputs), [name], **attributes))
        return name

    value = node("Sub", INPUT, tensor("target_center", policy.target_center))
    value = node("Div", value, tensor("target_half", policy.target_half))
    for number, layer in enumerate(policy.network):
        if isinstance(layer, nn.Linear):
            weight = tensor(f"weight_{number}", layer.weight)
            value = node("Gemm", value, weight, tensor(f"bias_{number}", layer.bias), transB=1)
        elif isinstance(layer, nn.ELU):
            value = node("Elu", value, alpha=float(layer.alpha))
        else:
            raise TypeError(f"no ONNX for the layer {layer}")
    value = node("Mul", node("Tanh", value), tensor("draw_half", policy.draw_half))
    nodes.append(
        helper.make_node("Add", [value, tensor("draw_center", policy.draw_center)], [OUTPUT])
    )
    graph = helper.make_graph(
        nodes,
        "slingshot policy: target displacement along y [m] to drawn position (y, z) [m]",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["batch", 1])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["batch", 2])],
        weights,
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION
    )
    onnx.checker.check_model(model)
    with replacing(path) as temporary:
        temporary.write_bytes(model.SerializeToString(deterministic=True))


def write_torchscript(policy: Policy, path: Path) -> None:
    """Write the policy as TorchScript, less its debug records, which hold this machine's paths."""
    saved, kept = io.BytesIO(), io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # torch would rather have torch.export
        # Frozen: a plain script lists attributes in the order of a set, which changes by run.
        torch.jit.save(torch.jit.freeze(torch.jit.script(policy.eval())), saved)
    with zipfile.ZipFile(saved) as source, zipfile.ZipFile(kept, "w") as target:
        for entry in source.infolist():
            if not entry.filename.endswith((".debug_pkl", "/serialization_id")):
                target.writestr(zipfile.ZipInfo(entry.filename), source.read(entry))
    with replacing(path) as temporary:
        temporary.write_bytes(kept.getvalue())


def card(
    trained: Trained,
    *,
    band: str,
    method: str,
    theta: dict[str, float],
    targets: tuple[float, float],
    max_force: float,
    map_error: dict,
) -> dict:
    """What a user of the files must know; no dates and no wall times: it is reproducible."""
    center, half = trained.policy.draw_center, trained.policy.draw_half
    low, high = (np.round((center + sign * half).tolist(), 6).tolist() for sign in (-1, 1))
    criterion = f"mean |y_p - g| <= {CONVERGED} m over {CHECKED_TARGETS} targets, no failure"
    return {
        "band": band,
        "method": method,
        "theta": theta,
        "input": {
            "name": INPUT,
            "unit": "m",
            "shape": ["batch", 1],
            "trained_range": list(targets),
        },
        "output": {
            "name": OUTPUT,
            "unit": "m",
            "shape": ["batch", 2],
            "axes": ["y", "z"],
            "frame": "origin midway between the fork tips, y towards the target, z up",
            "low": low,
            "high": high,
        },
        "max_force_n": max_force,
        "training": {
            "converged": trained.converged,
            "criterion": criterion,
            "iteration": trained.iteration,
            "iterations": len(trained.curve["iteration"]),
            "mean_error_m": _number(trained.mean_error),
            "max_error_m": _number(trained.max_error),
            "failed_targets": trained.failed_targets,
            "failed_launches": trained.failures,
        },
        "landing_map": map_error,
        "versions": {name: version(name) for name in ("torch", "rsl-rl-lib", "onnx", "numpy")},
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
