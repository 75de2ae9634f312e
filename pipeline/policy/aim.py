"""Aim: the policy's draw for a target, checked by a launch in the calibrated simulator."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.machine import cores
from pipeline.params import expect_known
from pipeline.policy.spread import landing_intervals, law_discrepancy, load_samples
from pipeline.policy.stored import PLAIN, ROBUST, Stored
from pipeline.stage import expect_from
from pipeline.theta import calibrated, in_air, load_theta, vector


def aim(
    params,
    band: str,
    method: str,
    target: float,
    root: str | Path = ".",
    launcher=None,
    robust: bool = False,
) -> dict:
    """Where to draw `band` so that the projectile lands at `target` [m].

    Args:
        params: The whole of params.yaml.
        robust: By the policy that was trained over what the identification leaves open.
        launcher: Simulates draws, shape (N, 2) [m], and with a second argument those of other θ,
            as `simulator` does; the calibrated simulator by default.

    Returns:
        draw_y_m, draw_z_m, predicted_landing_m, interval_90_m, hold_force_n, max_force_n (the
        arm's limit), warnings. The interval holds 90 % of the landings that samples of θ
        (data/confidence), the law's own error as the recording shows it, and an error of
        `trials.actuation_error` in the drawn position give. Landing and interval are None where
        the launch fails.

    Raises:
        UserError: Unknown band or method, or a file that is missing.
    """
    expect_known(params, "band", band)
    expect_known(params, "method", method)
    root = Path(root)
    source = root / "data" / "theta" / band / f"{method}.json"
    content = load_theta(expect_from(params.run, "theta", band, method, source), band)
    stored = Stored(params.run, band, method, root)
    draw = stored.draws(np.array([target]), ROBUST if robust else PLAIN)[0]
    launcher = launcher or simulator(params, band, content, root=root)
    launched = launcher(draw[None])
    warnings = []
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
        samples = load_samples(
            params.run, root / "data" / "confidence" / band / f"{method}.json", band, method
        )
        if samples is None:
            warnings.append("the interval leaves out how well the parameters are known")
        error, discrepancy = params.trials.actuation_error, law_discrepancy(content)
        found = landing_intervals(launcher, draw, samples, error, discrepancy)[0]
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
        "warnings": warnings,
    }


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
    from pipeline.sling.launch import launch

    sling, best = calibrated(params, band, content, root), vector(content)[None]
    threads = cores()

    def launcher(draws: np.ndarray, thetas: np.ndarray | None = None):
        moving, thetas = in_air(sling, best if thetas is None else thetas)
        return launch(moving, thetas, draws, max_force=max_force, device=device, workers=threads)

    return launcher
