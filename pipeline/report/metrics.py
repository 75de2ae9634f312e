"""What `dvc metrics show` shows: a few numbers a band and method, for variations side by side."""

from __future__ import annotations

import numpy as np

from pipeline.report.results import Result, Results
from pipeline.report.tables.benchmark import LAUNCHED
from pipeline.report.tables.landings import landing_errors, prediction_error


def metrics(results: Results) -> dict[str, dict]:
    """By "<band>-<method>": loss and errors in cm, shares of the distance in per cent.

    A key stands where there is such a number, so that a run of the rig shows nothing measured.
    """
    return {
        f"{one.band}-{one.method}": _of(one, results.floors.get(one.band, {})) for one in results
    }


def _of(result: Result, floor: dict) -> dict:
    entry = {
        "loss": _rounded(result.theta.get("loss", {}).get("total"), 1),
        "policy_cm": _rounded(result.card["training"]["mean_error_m"], 100),
    }
    if floor:
        entry["floor_cm"] = _rounded(floor["mean_error_m"], 100)
    groups = {kind: result.trials[result.trials.kind == kind] for kind in LAUNCHED}
    for name, trials in {**groups, "robust": result.robust_trials}.items():
        if trials.target.notna().any() and set(trials.kind) != {"predicted"}:
            total = landing_errors(trials)["all"]
            entry[f"{name}_cm"] = _rounded(total["mean"], 100)
            entry[f"{name}_failed"] = total["failed"]
    if len(groups["measured"]):
        inside = prediction_error(groups["measured"])["inside"]
        entry["prediction_percent"] = _rounded(inside["mean"], 100)
    return entry


def _rounded(value: float | None, factor: float) -> float | None:
    """To four digits: another kind of CPU differs beyond them."""
    if value is None or not np.isfinite(value):
        return None
    return float(f"{factor * value:.4g}")
