"""Results of bands and methods that never ran, as far as tables of launches look at them."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from pipeline.report.run.results import Results
from tests.report.run.conftest import THETA, confidence

TARGETS = (1.725, 1.925, 2.125)


def launches(
    errors: np.ndarray, kind: str = "virtual", targets=TARGETS, failed: int = 0
) -> pd.DataFrame:
    """Trials whose y - g is `errors` [m], shape (targets, repeats); the last `failed` fail."""
    errors = np.asarray(errors, float)
    target = np.repeat(targets, errors.shape[1])
    landing = target + errors.ravel()
    landing[len(landing) - failed :] = np.nan
    return pd.DataFrame({"target": target, "landing_y": landing}).assign(
        kind=kind, policy="plain", trial=np.tile(np.arange(errors.shape[1]) + 1, len(targets)),
        predicted_y=target, predicted_low=np.nan, predicted_high=np.nan,
        failure=np.where(np.isnan(landing), "too far", None), stretch=1.4, recorded_stretch=1.6,
    )  # fmt: skip


def result(band: str, method: str, trials: pd.DataFrame, **more) -> SimpleNamespace:
    """A method's θ, and its trials; `more` replaces what it has."""
    usual = {
        "theta": {"theta": THETA, "loss": {"geom": 1.0, "force": 0.5, "work": 0.25, "total": 1.5}},
        "confidence": confidence(),
        "card": {"training": {"converged": True, "mean_error_m": 0.004}},
    }
    return SimpleNamespace(band=band, method=method, trials=trials, **(usual | more))


def results(*some: SimpleNamespace, floors: dict | None = None) -> Results:
    methods: dict[str, dict] = {}
    for method_result in some:
        methods.setdefault(method_result.band, {})[method_result.method] = method_result
    return Results({}, methods, floors or {})


def ran(trials: dict[str, pd.DataFrame], floors: dict | None = None) -> Results:
    """Results of methods by "<band> <method>", of which only the trials matter."""
    return results(*(result(*name.split(), some) for name, some in trials.items()), floors=floors)


def floor(means: tuple[float, ...], deviations: tuple[float, ...]) -> dict:
    """An actuation floor of 20 launches a target [m]."""
    return {
        "targets": {
            f"{g:g}": {"mean_error_m": mean, "std_m": std, "launches": 20, "failed": 0}
            for g, mean, std in zip(TARGETS, means, deviations, strict=True)
        },
        "mean_error_m": float(np.mean(means)),
        "std_m": 0.02,
        "launches": 60,
        "failed": 0,
    }
