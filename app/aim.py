"""Aim: the policy's draw for a target, checked by a launch in the calibrated simulator."""

from __future__ import annotations

from pathlib import Path
from typing import NotRequired, TypedDict

import numpy as np

from pipeline.base.layout import Layout
from pipeline.landing.simulator import simulator
from pipeline.landing.stored import Stored
from pipeline.launches.spread import landing_intervals
from pipeline.params import expect_known
from pipeline.sling.theta import launch_history, load_samples, load_theta
from stages.start import unmounted


class Answer(TypedDict):
    """Where to draw; the keys are those of `sling aim --json`.

    The interval holds 90 % of the landings that samples of θ (data/confidence) and an error of
    `trials.actuation_error` in the drawn position give.
    Landing and interval are None where the launch fails.
    """

    draw_y_m: float
    draw_z_m: float
    predicted_landing_m: float | None
    interval_90_m: list[float] | None
    hold_force_n: float | None
    max_force_n: float  # the arm's limit
    pull_and_pause_s: NotRequired[list[float]]  # where the law remembers them
    warnings: list[str]


def pull_and_pause(params, content: dict) -> dict[str, list[float]]:
    """What a launch takes for granted of the hand, for a θ file whose law remembers it [s]."""
    history = launch_history(params, content)
    return {} if history is None else {"pull_and_pause_s": [history.pull_time, history.pause]}


def aim(
    params,
    band: str,
    method: str,
    target: float,
    root: str | Path = ".",
    launcher=None,
) -> Answer:
    """Where to draw `band` so that the projectile lands at `target` [m].

    Args:
        params: The whole of params.yaml.
        launcher: Simulates draws, shape (N, 2) [m], and with a second argument those of other θ,
            as `simulator` does; the calibrated simulator by default.

    Raises:
        UserError: Unknown band or method, or a file that is missing.
    """
    expect_known(params, "band", band)
    expect_known(params, "method", method)
    layout = Layout(Path(root))
    content = load_theta(layout.theta(band, method), band)
    stored = Stored(band, method, layout.root)
    draw = stored.draws(np.array([target]))[0]
    warnings = []
    if launcher is None:
        warnings += unmounted(band, root)
        launcher = simulator(params, band, content, root=root)
    launched = launcher(draw[None])
    low, high = params.policy.targets
    if not low <= target <= high:
        warnings.append(f"the policy was trained for targets from {low:g} to {high:g} m")
    landing, interval = None, None
    if launched.failure[0]:
        warnings.append(f"the launch fails in simulation: {launched.failure[0]}")
    else:
        landing = float(launched.landing_y[0])
        if abs(landing - target) > 0.05:
            warnings.append(f"the simulated landing is {landing - target:+.2f} m off the target")
        samples = load_samples(layout.confidence(band, method))
        if samples is None:
            warnings.append("the interval leaves out how well the parameters are known")
        found = landing_intervals(launcher, draw, samples, params.trials.actuation_error)[0]
        if np.isfinite(found).all():
            interval = found.tolist()
        else:
            warnings.append("no interval: too many launches beside the predicted one fail")
    force = float(launched.hold_force[0])
    if force > params.setup.max_force:
        warnings.append(
            f"holding this draw takes {force:.1f} N, more than setup.max_force"
            f" {params.setup.max_force:g} N"
        )
    return {
        "draw_y_m": float(draw[0]),
        "draw_z_m": float(draw[1]),
        "predicted_landing_m": landing,
        "interval_90_m": interval,
        "hold_force_n": force if np.isfinite(force) else None,
        "max_force_n": params.setup.max_force,
        **pull_and_pause(params, content),
        "warnings": warnings,
    }
