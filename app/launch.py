"""Launch: one draw in the simulator, with identified or hand-written parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app import safety
from app.aim import pull_and_pause
from app.arguments import finite
from pipeline.base.errors import UserError
from pipeline.base.layout import Layout, owner
from pipeline.identify.results.theta import (
    calibrated,
    launch_setup,
    load_samples,
    load_theta,
    parameters_of,
)
from pipeline.launching.surface.simulator import simulator
from pipeline.launching.trials.spread import landing_intervals
from pipeline.params import Params, expect_known
from pipeline.simulator.launch import launch


def expect_above_floor(params: Params, draw: tuple[float, float]) -> None:
    """Raises UserError where a draw (y, z) [m] lies below the floor."""
    floor = -params.setup.fork_height
    if draw[1] < floor:
        raise UserError(
            f"--draw: z = {draw[1]:g} m lies below the floor, z = {floor:g} m"
            " (setup.fork_height in params.yaml)"
        )


def launched(
    params: Params, band: str, theta: Path, draw: tuple[float, float], root: str | Path = "."
) -> dict:
    """What `sling launch --json` says of a draw (y, z) [m]; `warnings` are of app.safety.

    Raises:
        UserError: Unknown band, a draw that cannot be, or a θ file that is missing or wrong.
    """
    expect_known(params, "band", band)
    expect_above_floor(params, draw)
    content, root = load_theta(theta, band), Path(root)
    sling, setup = calibrated(params, band, content, root), launch_setup(params, content)
    result = launch(
        sling, setup, parameters_of(content), np.array(draw), max_force=params.setup.max_force
    )
    force, failure = result.hold_force[0], result.failure[0]
    return {
        "landing_y_m": finite(result.landing_y[0]),
        **_interval(params, band, theta, content, draw, root, failure),
        "speed_m_s": finite(result.speed[0]),
        "hold_force_n": finite(force),
        **pull_and_pause(params, content),
        "failure": failure,
        "warnings": [
            *safety.of_launch(params, force, failure),
            *safety.of_draw(params, band, draw, root),
            *safety.of_confidence(content, theta),
            *safety.of_identification(params, content, theta),
            *safety.of_mounting(params, band, root),
        ],
    }


def _interval(
    params: Params,
    band: str,
    theta: Path,
    content: dict,
    draw: tuple[float, float],
    root: Path,
    failure: str | None,
) -> dict:
    """`interval_90_m` of a landing by θ's samples, as `sling aim` has it; {} where θ has none."""
    at = owner(theta)
    if failure or not (at and at[2]):
        return {}
    samples = load_samples(Layout(root).confidence(band, at[2]), parameters_of(content))
    if samples is None:
        return {}
    launcher = simulator(params, band, content, root=root)
    error = params.trials.actuation_error
    interval = landing_intervals(launcher, np.array(draw), samples, error)[0]
    return {"interval_90_m": interval.tolist() if np.isfinite(interval).all() else None}
