"""A small policy on disk, with its card, as files of a finished run."""

import json
from pathlib import Path

import torch
from torch import nn

from sling2sim2real.launching.surface.landing_map import LandingMap
from sling2sim2real.policy.export import write_onnx
from sling2sim2real.policy.train import Policy
from tests.policy import toy


def write_stored(folder: Path) -> None:
    """Write policy.onnx and card.json, by the toy's landing map."""
    chart = LandingMap.simulate(
        toy.launch, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, size=(9, 9), max_force=15.0
    )
    card = {
        "training": {"converged": True, "mean_error_m": 0.004, "max_error_m": 0.01},
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "card.json").write_text(json.dumps(card))
    torch.manual_seed(0)
    network = nn.Sequential(nn.Linear(1, 8), nn.ELU(), nn.Linear(8, 2))
    write_onnx(Policy(network, (1.425, 2.425), chart), folder / "policy.onnx")
