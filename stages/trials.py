"""Launch with the policy of one band and method, or predict what was launched.

    python -m stages.trials band1 sling2sim2real

Reads data/policies/, data/theta/, data/confidence/ and data/episodes/, and for a recorded band
data/trials/measured/<band>.csv where it is there; writes data/trials/<band>/<method>.parquet.
A rig band is launched on the virtual rig, with the same actuation errors for every method. For a
recorded band the calibrated simulator predicts the measured launches, or else the policy's own.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from pipeline import errors
from pipeline.episode import Episode
from pipeline.params import load
from pipeline.policy import trials
from pipeline.policy.aim import policy_draws, simulator
from pipeline.policy.spread import landing_intervals, law_discrepancy, load_samples
from pipeline.stage import expect_episode, started
from pipeline.theta import load_theta


def main() -> None:
    params, band, method = started("band", "method")
    about, fork_width = params.bands[band], params.setup.fork_width
    theta = load_theta(Path("data/theta", band, f"{method}.json"), band)
    episode = Episode.load(expect_episode(band))
    measured = Path("data/trials/measured", f"{band}.csv")

    launches = []
    if about.source == "recording" and measured.is_file():
        launches = trials.read_measured(measured, method)
    if launches:
        kind = "measured"
        draws = np.array([[row["draw_y_m"], row["draw_z_m"]] for row in launches])
        targets = [row["target_m"] for row in launches]
        landing = [row["landing_y_m"] for row in launches]
        failure = [None if y is not None else "did not land" for y in landing]
    else:
        repeats = params.trials.repeats if about.source == "rig" else 1
        targets = [target for target in params.trials.targets for _ in range(repeats)]
        draws = policy_draws(Path("data/policies", band, method), np.array(targets))
        kind, landing, failure = "predicted", [None] * len(draws), [None] * len(draws)

    predicted = simulator(params, band, theta, params.setup.max_force)(draws)
    samples = load_samples(Path("data/confidence", band, f"{method}.json"), band, method)
    error, discrepancy = params.trials.actuation_error, law_discrepancy(theta)
    launcher = simulator(params, band, theta)
    intervals = landing_intervals(launcher, draws, samples, error, discrepancy)
    hold_force = predicted.hold_force
    if about.source == "rig":
        seeds = [1_000_000 * params.trials.seed + number for number in range(len(draws))]
        with ProcessPoolExecutor(mp_context=get_context("spawn")) as pool:
            launched = list(pool.map(partial(_on_the_rig, band), draws, seeds))
        kind, failure = "virtual", [one.failure for one in launched]
        landing = [one.landing_y if one.failure is None else None for one in launched]
        hold_force = np.array([one.hold_force for one in launched])

    table = trials.table(
        band=band,
        method=method,
        kind=kind,
        draws=draws,
        targets=targets,
        predicted=predicted,
        intervals=intervals,
        landing=landing,
        failure=failure,
        hold_force=hold_force,
        stretch=trials.stretch_of(np.insert(draws, 0, 0, axis=1), fork_width, about.rest_length),
        recorded=trials.recorded_stretch(episode, fork_width, about.rest_length),
    )
    trials.save(table, Path("data/trials", band, f"{method}.parquet"))
    print(f"{band} {method}: {len(draws)} launches ({kind})")


def _on_the_rig(band: str, draw: np.ndarray, seed: int):
    """One launch in a process of its own: the rig takes seconds, on one core."""
    from pipeline.rig.launch import launch

    return launch(band, load(), draw, seed)


if __name__ == "__main__":
    errors.run(main)
