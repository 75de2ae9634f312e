"""Launch: one draw in the simulator, with identified or hand-written parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.params import Params
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout, owner
from sling2sim2real.cli import safety
from sling2sim2real.cli.arguments import finite
from sling2sim2real.identification.results.theta import (
    history_of,
    load_samples,
    load_theta,
    parameters_of,
)
from sling2sim2real.launching.surface.landing_map import Launcher
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.trials.spread import landing_intervals
from sling2sim2real.settings import expect_known
from sling2sim2real.simulator.launch import limited
from sling2sim2real.simulator.parameters import Parameters


def expect_above_floor(params: Params, draw: tuple[float, float]) -> None:
    """Raises UserError where a draw (y, z) [m] lies below the floor."""
    floor = -params.setup.fork_height
    if draw[1] < floor:
        raise UserError(
            f"--draw: z = {draw[1]:g} m lies below the floor, z = {floor:g} m"
            " (setup.fork_height in params.yaml)"
        )


def launch_output(
    params: Params, band: str, theta: Path, draw: tuple[float, float], root: str | Path = "."
) -> dict:
    """What `sling launch --json` says of a draw (y, z) [m]; `warnings` are of safety.py.

    Raises:
        UserError: Unknown band, a draw that cannot be, or a θ file that is missing or wrong.
    """
    expect_known(params, "band", band)
    expect_above_floor(params, draw)
    content, root = load_theta(theta, band), Path(root)
    launcher, samples = simulator(params, band, content, root=root), _samples(theta, content, root)
    result = limited(launcher(np.array([draw])), params.setup.max_force)
    force, failure = result.hold_force[0], result.failure[0]
    interval = {}
    if samples is not None and not failure:
        error = params.trials.actuation_error
        interval["interval_90_m"] = interval_90(launcher, draw, samples, error)
    return {
        "landing_y_m": finite(result.landing_y[0]),
        **interval,
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


def pull_and_pause(params: Params, content: dict) -> dict[str, list[float]]:
    """What a launch takes for granted of the hand, for a θ file whose law remembers it [s]."""
    history = history_of(params, content)
    return {} if history is None else {"pull_and_pause_s": [history.pull_time, history.pause]}


def interval_90(
    launcher: Launcher,
    draw: tuple[float, float] | np.ndarray,
    samples: Parameters | None,
    error: float,
) -> list[float] | None:
    """Where 90 % of the launches from a draw (y, z) land [m]; None where too many of them fail.

    Args:
        launcher, samples, error: As `landing_intervals` takes them.
    """
    interval = landing_intervals(launcher, np.array(draw), samples, error)[0]
    return interval.tolist() if np.isfinite(interval).all() else None


def _samples(theta: Path, content: dict, root: Path) -> Parameters | None:
    """Samples of a run's θ file; None of any other, and where the method has none."""
    at = owner(theta)
    if not (at and at[2]):
        return None
    return load_samples(Layout(root).confidence(content["band"], at[2]), parameters_of(content))
