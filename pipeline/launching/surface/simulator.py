"""The simulator as a policy is trained and judged in it: calibrated by a θ file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.base.machine import cores
from pipeline.identify.results.theta import at_points, calibrated, vector
from pipeline.params import Params
from pipeline.simulator.launch import launch


def asked_of_the_hand(
    params: Params, band: str, content: dict, draw: np.ndarray, root: str | Path = "."
) -> dict[str, float] | None:
    """How the hand must draw a band whose law remembers it, and what it costs not to.

    Returns:
        `pull_time_s`, `pause_s`, and by how much a pause of a second more moves the landing of
        `draw` (2,) [m], None where it does not land; None for a law without memory.
    """
    sling, theta = calibrated(params, band, content, root), vector(content)
    if sling.history is None:
        return None
    longer = replace(sling, history=replace(sling.history, pause=sling.history.pause + 1))
    moved = float(np.diff([launch(one, theta, draw).landing_y[0] for one in (sling, longer)])[0])
    return {
        "pull_time_s": sling.history.pull_time,
        "pause_s": sling.history.pause,
        "second_more_m": moved if np.isfinite(moved) else None,
    }


def simulator(
    params: Params,
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
