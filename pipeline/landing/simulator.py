"""The simulator as a policy is trained and judged in it: calibrated by a θ file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.base.machine import cores
from pipeline.sling.launch import launch
from pipeline.sling.theta import calibrated, in_air, vector


def simulator(
    params,
    band: str,
    content: dict,
    max_force: float = np.inf,
    root: str | Path = ".",
    device: str | Sequence[str] = "cpu",
):
    """Function that launches draws, shape (N, 2) [m], in the simulator calibrated by a θ file.

    A second argument gives each launch a θ of its own, shape (N, 5), or with a sixth column a drag
    of the air as well.
    """
    sling, best = calibrated(params, band, content, root), vector(content)[None]
    threads = cores()

    def launcher(draws: np.ndarray, thetas: np.ndarray | None = None):
        moving, thetas = in_air(sling, best if thetas is None else thetas)
        return launch(moving, thetas, draws, max_force=max_force, device=device, workers=threads)

    return launcher
