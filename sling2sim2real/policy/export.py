"""Write a trained policy as ONNX, with a JSON card that says what it is.

The network takes targets in metres, shape (batch, 1), and gives draws in metres, shape (batch, 2):
the normalisation is inside. A policy that sees the projectile takes its position (y, z) before the
target. Equal networks give equal bytes, so the cache sees when nothing changed.
"""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from torch import nn

from sling2sim2real.base.files import replacing, write_json
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.policy.train import Policy, Trained
from sling2sim2real.settings import Settings
from sling2sim2real.settings.provenance import policy_settings_of
from sling2sim2real.simulator.model import LaunchHistory
from sling2sim2real.simulator.rubber import NEO_HOOKEAN

OPSET, IR_VERSION = 18, 10  # any onnxruntime from 1.18 (2024) on reads these
INPUT, OUTPUT = "target", "draw"
PROJECTILE = "projectile"  # a second input, of a policy that sees it
FRAME = "origin midway between the fork tips, y towards the target, z up"
USED = ("sling2sim2real", "torch", "rsl-rl-lib", "onnx", "numpy")


def export(
    trained: Trained, stored: Stored, params: Settings, band: str, method: str, theta: dict, **more
) -> None:
    """Write a policy's files: the network, then its card, which says that both are there.

    Args:
        params, band, method, theta, more: As `card` has them.
    """
    write_onnx(trained.policy, stored.network)
    content = card(trained.policy, params, band, method, theta, **more)
    write_json(stored.card_file, content)


def write_onnx(policy: Policy, path: Path) -> None:
    """Write the policy as one self-contained ONNX file with a free batch size.

    The graph is spelled out, because torch's exporter puts the weights into a second file and the
    paths of this machine into the first.
    """
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    nodes, weights = [], {}

    def tensor(name: str, values: torch.Tensor) -> str:
        weights[name] = numpy_helper.from_array(values.detach().numpy(), name)
        return name

    def node(kind: str, *inputs: str, **attributes) -> str:
        name = f"{kind.lower()}_{len(nodes)}"
        nodes.append(helper.make_node(kind, list(inputs), [name], **attributes))
        return name

    value = node("Sub", INPUT, tensor("target_center", policy.target_center))
    value = node("Div", value, tensor("target_half", policy.target_half))
    ports, seen = {INPUT: 1}, "target displacement along y [m]"
    if policy.projectile is not None:
        ports, seen = {PROJECTILE: 2, **ports}, f"projectile position (y, z) [m] and {seen}"
        position = node("Sub", PROJECTILE, tensor("draw_center", policy.draw_center))
        position = node("Div", position, tensor("draw_half", policy.draw_half))
        value = node("Concat", position, value, axis=1)
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
        f"slingshot policy: {seen} to drawn position (y, z) [m]",
        [
            helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", columns])
            for name, columns in ports.items()
        ],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["batch", 2])],
        list(weights.values()),
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION
    )
    onnx.checker.check_model(model)
    with replacing(path) as temporary:
        temporary.write_bytes(model.SerializeToString(deterministic=True))


def card(
    policy: Policy,
    params: Settings,
    band: str,
    method: str,
    theta: dict,
    *,
    training: dict,
    history: LaunchHistory | None = None,
    device: str = "cpu",
) -> dict:
    """What a user of the files must know; no dates and no wall times: it is reproducible.

    Args:
        params: The whole of params.yaml.
        theta: Content of the theta file whose simulator the policy was trained in.
        training: What `check.figures` says of it; NaN becomes null.
        history: How the hand must draw the band, where its law remembers that.
        device: Where it was trained, "cpu" or "cuda".
    """
    center, half = policy.draw_center, policy.draw_half
    low, high = (np.round((center + sign * half).tolist(), 6).tolist() for sign in (-1, 1))
    return {
        "band": band,
        "method": method,
        "theta": theta["theta"],
        "law": theta.get("law", NEO_HOOKEAN),
        "nuisances": theta.get("nuisances", {}),
        "launch": history and {"pull_time_s": history.pull_time, "pause_s": history.pause},
        "input": {
            "name": INPUT,
            "unit": "m",
            "shape": ["batch", 1],
            "meaning": "displacement of the target along y, on the floor",
            "trained_range": list(params.policy.targets),
        },
        **_projectile(policy),
        "output": {
            "name": OUTPUT,
            "unit": "m",
            "shape": ["batch", 2],
            "axes": ["y", "z"],
            "meaning": "where the arm is sent to draw the projectile",
            "frame": FRAME,
            "low": low,
            "high": high,
        },
        "max_force_n": params.setup.max_force,
        "made_with": policy_settings_of(params, band),
        "training": _strict(training),
        "trained_on": {"device": device},
        "versions": {name: version(name).partition("+")[0] for name in USED},
    }


def _projectile(policy: Policy) -> dict:
    """Part of the card on the input of a policy that sees the projectile; empty for any other."""
    if policy.projectile is None:
        return {}
    content = {
        "name": PROJECTILE,
        "unit": "m",
        "shape": ["batch", 2],
        "axes": ["y", "z"],
        "meaning": "where the projectile hangs in the slack band before it is drawn",
        "frame": FRAME,
        "trained_at": np.round(policy.projectile.tolist(), 6).tolist(),  # there alone
    }
    return {PROJECTILE: content}


def _strict(value: object) -> object:
    """Make a value strict JSON: no NaN, no numbers of NumPy's."""
    if isinstance(value, dict):
        return {name: _strict(entry) for name, entry in value.items()}
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
