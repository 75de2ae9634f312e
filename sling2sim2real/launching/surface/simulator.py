"""The simulator as a policy is trained and judged in it: calibrated by a θ file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from sling2sim2real.base.machine import cores
from sling2sim2real.identification.results.theta import calibrated, launch_setup, parameters_of
from sling2sim2real.settings import Settings
from sling2sim2real.simulator.launch import Launches, launch
from sling2sim2real.simulator.parameters import Parameters


def asked_of_the_hand(
    params: Settings, band: str, content: dict, draw: np.ndarray, clamps: Path | None
) -> dict[str, float | None] | None:
    """How the hand must draw a band whose law remembers it, and what it costs not to.

    Returns:
        `pull_time_s`, `pause_s`, and by how much a pause of a second more moves the landing of
        `draw` (2,) [m], None where it does not land; None for a law without memory.
    """
    setup = launch_setup(params, content)
    if setup.history is None:
        return None
    sling, theta = calibrated(params, band, content, clamps), parameters_of(content)
    longer = replace(setup, history=replace(setup.history, pause=setup.history.pause + 1))
    landings = [launch(sling, variant, theta, draw).landing_y[0] for variant in (setup, longer)]
    moved = float(np.diff(landings)[0])
    return {
        "pull_time_s": setup.history.pull_time,
        "pause_s": setup.history.pause,
        "second_more_m": moved if np.isfinite(moved) else None,
    }


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
