"""Aim: the policy's draw for a target, checked by a launch in the calibrated simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.errors import UserError
from pipeline.params import expect_known
from pipeline.theta import load_theta, vector

NORMAL_95 = 1.6448536269514722  # 90 % of a normal distribution lies within this many deviations


def policy_draws(folder: Path, targets: np.ndarray) -> np.ndarray:
    """Draws (y, z) [m], shape (N, 2), of the exported policy in `folder` for targets [m], (N,).

    Raises:
        UserError: The policy is not there, or damaged.
    """
    import onnxruntime

    path = Path(folder) / "policy.onnx"
    band, method = path.parts[-3:-1]
    if not path.is_file():
        raise UserError(f"{path}: no such file; `dvc repro policy@{band}-{method}` trains it")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 4  # what is wrong is said below
    targets = np.asarray(targets, np.float32)[:, None]
    try:
        session = onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=["CPUExecutionProvider"]
        )
        return session.run(["draw"], {"target": targets})[0].astype(float)
    except Exception as error:  # onnxruntime has an error of its own for each kind of damage
        raise UserError(
            f"{path}: damaged; `dvc repro --force policy@{band}-{method}` makes it anew"
        ) from error


def aim(
    params, band: str, method: str, target: float, root: str | Path = ".", launcher=None
) -> dict:
    """Where to draw `band` so that the projectile lands at `target` [m].

    Args:
        params: The whole of params.yaml.
        launcher: Simulates draws, shape (N, 2) [m]; the calibrated simulator by default.

    Returns:
        draw_y_m, draw_z_m, predicted_landing_m, interval_90_m, hold_force_n, warnings. The
        interval covers 90 % of the landings that an error of `trials.actuation_error` in the drawn
        position spreads around the prediction, by the launch's own gradient; that θ is not known
        exactly is not in it. Landing and interval are None where the launch fails.

    Raises:
        UserError: Unknown band or method, or a file that is missing.
    """
    expect_known(params, "band", band)
    expect_known(params, "method", method)
    root = Path(root)
    theta = load_theta(root / "data" / "theta" / band / f"{method}.json", band)
    draw = policy_draws(root / "data" / "policies" / band / method, np.array([target]))[0]
    launcher = launcher or simulator(params, band, vector(theta))
    step = 1e-3  # m, small against the box and large against the simulator's rounding
    around = draw + step * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    launched = launcher(around)
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
        if not any(launched.failure):
            ahead, behind = launched.landing_y[1::2], launched.landing_y[2::2]
            gradient = (ahead - behind) / (2 * step)
            half = float(NORMAL_95 * params.trials.actuation_error * np.hypot(*gradient))
            interval = [landing - half, landing + half]
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
        "warnings": warnings,
    }


def simulator(
    params, band: str, theta: np.ndarray, max_force: float = np.inf, root: str | Path = "."
):
    """Function that launches draws, shape (N, 2) [m], in the simulator calibrated with `theta`."""
    import os

    from pipeline.sling.launch import launch
    from pipeline.sling.model import load_sling

    sling = load_sling(params, band, root)
    workers = os.cpu_count() or 1

    def launcher(draws: np.ndarray):
        return launch(sling, theta[None], draws, max_force=max_force, workers=workers)

    return launcher
