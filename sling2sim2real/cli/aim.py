"""Aim: the policy's draw for a target, checked by a launch in the calibrated simulator."""

from __future__ import annotations

from pathlib import Path
from typing import NotRequired, TypedDict, cast

import numpy as np

from pipeline.params import Params
from sling2sim2real.base.layout import Layout
from sling2sim2real.cli import safety
from sling2sim2real.cli.launch import interval_90, pull_and_pause
from sling2sim2real.cli.safety import Hazard
from sling2sim2real.identification.results.theta import load_samples, load_theta, parameters_of
from sling2sim2real.launching.surface.landing_map import Launcher
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.settings import expect_known


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
    warnings: list[Hazard]


def aim(
    params: Params,
    band: str,
    method: str,
    target: float,
    root: str | Path = ".",
    launcher: Launcher | None = None,
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
    file = layout.theta(band, method)
    content = load_theta(file, band)
    stored = Stored(band, method, layout.root)
    draw = stored.draws(np.array([target]))[0]
    if launcher is None:
        launcher = simulator(params, band, content, root=root)
    launched = launcher(draw[None])
    force, failure = float(launched.hold_force[0]), launched.failure[0]
    low, high = params.policy.targets
    warnings = []
    if not low <= target <= high:
        what = f"the policy was trained for targets from {low:g} to {high:g} m, not {target:g} m"
        warnings.append(Hazard("target", what))
    warnings += safety.of_launch(params, force, failure)
    landing, interval = None, None
    if not failure:
        landing = float(launched.landing_y[0])
        if abs(landing - target) > safety.MISS:
            what = f"the simulated landing is {landing - target:+.2f} m off the target"
            warnings.append(Hazard("miss", what))
        path = layout.confidence(band, method)
        samples = load_samples(path, parameters_of(content))
        interval = interval_90(launcher, draw, samples, params.trials.actuation_error)
        if interval is None:
            what = "no interval: too many launches beside the predicted one fail"
            warnings.append(Hazard("interval", what))
    warnings += safety.of_draw(params, band, draw, layout.root)
    warnings += safety.of_confidence(content, file)
    warnings += safety.of_policy(params, band, method, content, layout.root)
    warnings += safety.of_mounting(params, band, layout.root)
    answer = {
        "draw_y_m": float(draw[0]),
        "draw_z_m": float(draw[1]),
        "predicted_landing_m": landing,
        "interval_90_m": interval,
        "hold_force_n": force if np.isfinite(force) else None,
        "max_force_n": params.setup.max_force,
        **pull_and_pause(params, content),
        "warnings": warnings,
    }
    return cast(Answer, answer)


def why_refused(answer: Answer) -> str | None:
    """Why no robot should carry an answer out: it misses, fails, or the arm may not hold it."""
    reasons = {warning.about: warning.what for warning in answer["warnings"]}
    return next(
        (reasons[topic] for topic in ("failure", "miss", "force") if topic in reasons), None
    )
