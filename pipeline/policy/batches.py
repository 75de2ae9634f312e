"""Launches of the trials: what a user measured, and what the policies aim, a virtual world launches
and the calibrated simulator predicts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from pipeline.policy.measured import file_of, read_measured
from pipeline.policy.spread import landing_intervals
from pipeline.policy.stored import Stored
from pipeline.policy.trials import Batch, limited, trial_seed
from pipeline.pool import Pool


def measured(params, band: str, method: str, folder: Path) -> list[Batch]:
    """The user's launches of the band that say something about the method, if there are any.

    Args:
        params: The whole of params.yaml.
        folder: Of the users' files, one a band.

    Raises:
        UserError: A file is no band's, or the band's own cannot be used.
    """
    path = file_of(folder, band, params.bands)
    launches = read_measured(path, method, params.methods) if path else []
    if not launches:
        return []
    draws, landing, targets = zip(*((o.draw, o.landing, o.target) for o in launches), strict=True)
    failure = [None if y is not None else "did not land" for y in landing]
    return [Batch.without_flight("measured", None, draws, targets, list(landing), failure)]


def aimed(stored: Stored, targets: list[float]) -> list[Batch]:
    """What each of the method's policies would launch at the targets [m]. Raises UserError."""
    return [
        Batch.without_flight("predicted", kind, stored.draws(np.array(targets), kind), targets)
        for kind in stored.kinds()
    ]


def launched(batches: list[Batch], launch: Callable, trials) -> list[Batch]:
    """The same launched in a virtual world; launches of equal number have equal errors.

    Args:
        launch: `launch(draw, seed)` gives landing_y [m], NaN where there is none, failure,
            hold_force [N] and flight. It goes to processes of its own: it keeps one core busy.
        trials: The `trials:` section of params.yaml.
    """
    with Pool() as pool:
        return [
            _virtual(batch, list(pool.map(launch, batch.draws, _seeds(batch, trials))))
            for batch in batches
        ]


def _seeds(batch: Batch, trials) -> list[int]:
    return trial_seed(trials, np.arange(len(batch.draws))).tolist()


def _virtual(batch: Batch, tried: list) -> Batch:
    return replace(
        batch,
        kind="virtual",
        landing=[one.landing_y if np.isfinite(one.landing_y) else None for one in tried],
        failure=[one.failure for one in tried],
        hold_force=[one.hold_force for one in tried],
        flight=[one.flight for one in tried],
    )


def predicted(
    batches: list[Batch], launcher: Callable, samples: np.ndarray | None, params, discrepancy: float
):
    """What the calibrated simulator makes of the draws of all batches, N in all.

    Args:
        launcher, samples, discrepancy: As `landing_intervals` has them.
        params: The whole of params.yaml.

    Returns:
        Its launches, limited by the arm, and where 90 % of them would land [m], shape (N, 2); NaN
        where that is not known.
    """
    draws = np.concatenate([batch.draws for batch in batches])
    launches = limited(launcher(draws), params.setup.max_force)
    once, again = np.unique(draws, axis=0, return_inverse=True)
    error = params.trials.actuation_error
    intervals = landing_intervals(launcher, once, samples, error, discrepancy)[again]
    intervals[np.isnan(launches.landing_y)] = np.nan
    return launches, intervals
