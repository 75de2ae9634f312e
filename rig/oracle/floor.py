"""The actuation floor of a band: how far an oracle's launches land from their targets.

The oracle's draws are exact but for what no policy can help: the error of the drawn position and
the kick of the opening fingers. Launches of a policy that come near this floor miss for no other
reason.
"""

from __future__ import annotations

import numpy as np

from pipeline.params import Params


def trial_numbers(params: Params) -> np.ndarray:
    """Numbers of a floor's launches, one row a target: first the trials' own, then others."""
    trials, more = params.trials, params.floor.launches
    shape = len(trials.targets), trials.repeats
    numbers = np.arange(shape[0] * shape[1]).reshape(shape)
    others = numbers.size + np.arange(shape[0] * more).reshape(shape[0], more)
    return np.hstack([numbers, others])


def errors_of(draws: np.ndarray, landings: np.ndarray, params: Params) -> dict:
    """How far launches land from the targets of the trials.

    Args:
        draws: One a target (y, z) [m], shape (T, 2); NaN where it is out of reach.
        landings: Of launches from them [m], NaN where one failed, shape (T, N), by number as
            `trial_numbers` has them.

    Returns:
        For all launches, and under "targets" for each target with its "draw": mean_error_m and
        std_m (of a sample) of |y - g|, bias_m, the mean of y - g, launches, failed ones, and
        trials_mean_error_m, the mean over launches with the errors of the trials. None where
        nothing landed, and for the draw where there is none.
    """
    targets = params.trials.targets
    missed = landings - np.array(targets)[:, None]
    of_trials = missed[:, : params.trials.repeats]
    return {
        "targets": {
            repr(target): {
                "draw": None if np.isnan(draw).any() else list(map(float, draw)),
                **_error(miss, mine),
            }
            for target, draw, miss, mine in zip(targets, draws, missed, of_trials, strict=True)
        },
        **_error(missed, of_trials),
    }


def _error(missed: np.ndarray, of_trials: np.ndarray) -> dict:
    landed = missed[np.isfinite(missed)]
    size = np.abs(landed)
    return {
        "mean_error_m": _mean(size),
        "std_m": float(size.std(ddof=1)) if len(size) > 1 else None,
        "bias_m": _mean(landed),
        "launches": missed.size,
        "failed": missed.size - len(landed),
        "trials_mean_error_m": _mean(np.abs(of_trials[np.isfinite(of_trials)])),
    }


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if len(values) else None
