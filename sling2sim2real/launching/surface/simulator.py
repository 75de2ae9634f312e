"""The simulator as a policy is trained and judged in it: calibrated by a θ file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.identification.results.theta import calibrated, launch_setup, parameters_of
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches, launch
from sling2sim2real.simulator.parameters import Parameters


def simulator(
    params: Settings,
    band: str,
    content: dict,
    clamps: Path | None,
    device: str = "cpu",
) -> Callable[..., Launches]:
    """Function that launches draws, shape (N, 2) [m], in the simulator calibrated by a θ file.

    A second argument gives each launch parameters of its own.
    """
    sling, best = calibrated(params, band, content, clamps), parameters_of(content)
    setup, threads = launch_setup(params, content), cores()

    def launcher(draws: np.ndarray, parameters: Parameters = best) -> Launches:
        return launch(sling, setup, parameters, draws, device=device, workers=threads)

    return launcher
