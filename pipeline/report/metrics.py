"""What `dvc metrics show` shows: losses and landing errors by band and method."""

from __future__ import annotations

import numpy as np

from pipeline.report.results import Results
from pipeline.report.tables.landings import intervals, landing_errors, prediction_error


def metrics(results: Results) -> dict:
    content: dict = {}
    for result in results:
        entry: dict = {"loss": _rounded(result.theta.get("loss", {}).get("total"), 1)}
        entry["policy_error_cm"] = _rounded(result.card["training"]["mean_error_m"], 100)
        for kind, trials in result.trials.groupby("kind", sort=True):
            if kind != "predicted" and trials.target.notna().any():
                total = landing_errors(trials)["all"]
                entry[f"{kind}_landing_error_cm"] = _rounded(total["mean"], 100)
                entry[f"{kind}_failed"] = total["failed"]
            if kind == "measured":
                for part, error in prediction_error(trials).items():
                    entry[f"prediction_error_{part}_percent"] = _rounded(error["mean"], 100)
                    entry[f"prediction_bias_{part}_percent"] = _rounded(error["bias"], 100)
                    entry[f"unpredicted_{part}"] = error["unpredicted"]
            for part, one in (intervals(trials) or {}).items():
                if one["launches"]:
                    entry[f"{kind}_in_interval_{part}"] = one["covered"] / one["launches"]
        content.setdefault(result.band, {})[result.method] = entry
    return content


def _rounded(value: float | None, factor: float) -> float | None:
    return round(factor * value, 4) if value is not None and np.isfinite(value) else None
