"""What worker.py reads: bands as deformable volumes in USD's text form, and how they are led.

The stage is by the schemas of PhysX and Omni Physics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import STEPS_PER_S, stage

SPACING = np.array([1.0, 2.5])  # m along x and y from band to band: none reaches the next
COLUMNS = 32
PLACE = """        float3 xformOp:translate = (%g, %g, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
"""


@dataclass(frozen=True)
class Drive:
    """A phase in which some nodes are led along a path; the others are free.

    Attributes:
        vertices: Those that are led, shape (D,).
        targets: Where they are at the end of each step [m], shape (S, D, 3) in every band, or
            (S, N, D, 3), one for each; with (1, ...) for all steps.
        fade: How much of their distance from targets[0] at the phase's begin is left, shape (S,).
        keep: Whether the nodes' places after each step are wanted.
    """

    vertices: np.ndarray
    targets: np.ndarray
    fade: np.ndarray
    keep: bool = False


def job(tube: Tube, start: np.ndarray, phases: list[Drive]) -> dict:
    """What is done with the N bands of a stage, whose nodes begin at `start` (N, nodes, 3) [m]."""
    content = {
        "step": 1 / STEPS_PER_S,
        "phases": len(phases),
        "offsets": offsets(len(start)),
        "rest": tube.rest.reshape(-1, 3),
        "start": start,
    }
    for i, phase in enumerate(phases):
        content |= {f"{name}_{i}": value for name, value in vars(phase).items()}
    return content


def offsets(count: int) -> np.ndarray:
    """Where each band's origin stands [m], shape (count, 3)."""
    row, column = np.divmod(np.arange(count), COLUMNS)
    return np.stack([column * SPACING[0], row * SPACING[1], 0.0 * row], axis=1)


def text(tube: Tube, thetas: np.ndarray) -> str:
    """The scene.

    Args:
        thetas: The five parameters of each band, shape (N, 5); the damping scale has no slot.
    """
    rows = zip(thetas, offsets(len(thetas)), strict=True)
    names = "young", "poisson", "damping", "friction"
    return stage(
        tube,
        [
            {
                **dict(zip(names, theta[:4], strict=True)),
                "material": f"M{i:05d}",
                "name": f"B{i:05d}",
                "place": PLACE % tuple(place[:2]),
            }
            for i, (theta, place) in enumerate(rows)
        ],
    )
