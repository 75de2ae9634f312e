"""The simulator as a policy is trained and judged in it: calibrated by a θ file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.base.machine import cores
from pipeline.sling.launch import launch
from pipeline.sling.theta import at_points, calibrated, vector


def simulator(
    params,
    band: str,
    content: dict,
    max_force: float = np.inf,
    root: str | Path = ".",
    device: str | Sequence[str] = "cpu",
):
    """Function that launches draws, shape (N, 2) [m], in the simulator calibrated by a θ file.

    A second argument gives each launch a point of its own, shape (N, P), as `at_points` has them.
    """
    sling, best = calibrated(params, band, content, root), vector(content)[None]
    threads = cores()

    def launcher(draws: np.ndarray, thetas: np.ndarray | None = None):
        own, theta = (sling, best) if thetas is None else at_points(sling, thetas)
        return launch(own, theta, draws, max_force=max_force, device=device, workers=threads)

    return launcher
