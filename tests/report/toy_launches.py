"""Launches that never were, and an oracle's: errors known exactly."""

import numpy as np
import pandas as pd

TARGETS = (1.725, 1.925, 2.125)


def launches(
    errors, kind: str = "virtual", targets=TARGETS, failed: int = 0, **more: object
) -> pd.DataFrame:
    """Trials whose y - g is `errors` [m], shape (targets, repeats); the last `failed` fail.

    They are predicted to land 2 % short, and from 4 % short to 6 % long. `more` replaces columns.
    """
    errors = np.asarray(errors, float)
    target = np.repeat(targets, errors.shape[1])
    landing = target + errors.ravel()
    landing[len(landing) - failed :] = np.nan
    usual = {
        "target": target, "landing_y": landing, "kind": kind, "policy": None,
        "trial": np.tile(np.arange(errors.shape[1]) + 1, len(targets)),
        "draw_y": -0.3, "draw_z": -0.2, "hold_force": 9.0,
        "failure": np.where(np.isnan(landing), "too far", None), "flight_y": None, "flight_z": None,
        "stretch": 1.4, "recorded_stretch": 1.6, "predicted_y": 0.98 * landing,
        "predicted_failure": None, "predicted_speed": 4.5, "predicted_angle": 0.5,
        "predicted_leave_y": -0.05, "predicted_leave_z": -0.03, "predicted_low": 0.96 * landing,
        "predicted_high": 1.06 * landing,
    }  # fmt: skip
    return pd.DataFrame(usual | more)


def floor(mean: float | None = None) -> dict:
    """An actuation floor of 20 launches a target that miss by `mean` [m]; None: all failed."""
    of_target = {"mean_error_m": mean, "std_m": mean and 0.003, "bias_m": mean and 0.001}
    of_target |= {"launches": 20, "failed": 0 if mean else 20}
    return of_target | {
        "launches": 60,
        "failed": 0 if mean else 60,
        "targets": {f"{target:g}": of_target for target in TARGETS},
    }
