"""An engine in place of PhysX: its bands are two straight halves of PhysX's law, without mass."""

import numpy as np

from pipeline.export.mesh import Tube
from pipeline.export.usd import nominal
from pipeline.simulator.cylinder import volumes


class StringEngine:
    """Takes jobs as `bands.Engine` does, and leaves all nodes but the led ones at rest.

    Attributes:
        tube: Of the bands.
        texts: Of the stages that it was given.
    """

    def __init__(self, tube: Tube) -> None:
        self.tube, self.texts = tube, []

    def run(self, text: str, job: dict, steer) -> dict:
        self.texts.append(text)
        count, hand = len(job["offsets"]), len(self.tube.rest[0])
        targets = job["targets_1"][-1]
        while targets is not None:
            nodes = np.tile(self.tube.rest, (count, 1, 1, 1))
            nodes[:, self.tube.middle] = targets[:, -hand:]
            targets = steer(nodes.reshape(count, -1, 3))
        return {}


def force_on(tube, sections, nodes, young, poisson, step=None) -> np.ndarray:
    """Pull of both halves on middles wherever `nodes` have them, shape (N, 3)."""
    area = volumes(tube.rest, tube.tetrahedra).sum() / np.ptp(tube.rest[..., 0])
    places, length = nodes[:, sections[0]].mean(axis=1), np.ptp(tube.rest[1:-1, 0, 0]) / 2
    tips = tube.clamped[[1, -2], 0]
    away = tips - places[:, None]
    far = np.linalg.norm(away, axis=-1)
    pull = np.array([nominal(np.maximum(row, length) / length, poisson[0]) for row in far])
    return (area * young[:, None, None] * pull[..., None] * away / far[..., None]).sum(axis=1)
