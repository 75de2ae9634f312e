"""Launch with the policies of one band and method, and predict what is launched.

    python -m stages.trials band1 sling2sim2real

Reads data/policies/, data/theta/, data/confidence/ and data/episodes/, and
data/trials/measured/<band>.csv where it is there; writes data/trials/<band>/<method>.parquet.
A rig band is launched on the virtual rig, with the same errors for every method and policy. For a
recorded band the calibrated simulator predicts the measured launches, or else the policies' own.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from pipeline import errors
from pipeline.episode import Episode
from pipeline.params import Params, load
from pipeline.policy import trials
from pipeline.policy.aim import ROBUST, policy_draws, simulator
from pipeline.policy.measured import read_measured
from pipeline.policy.spread import landing_intervals, law_discrepancy, load_samples
from pipeline.policy.trials import Batch
from pipeline.pool import Pool
from pipeline.stage import expect_episode, expect_from, started
from pipeline.theta import load_theta


def main() -> None:
    params, band, method = started("band", "method")
    about, fork_width = params.bands[band], params.setup.fork_width
    source = expect_from(
        params.run, "theta", band, method, Path("data/theta", band, f"{method}.json")
    )
    theta = load_theta(source, band)
    source = Path("data/confidence", band, f"{method}.json")
    samples = load_samples(params.run, source, band, method)
    episode = Episode.load(expect_episode(band))

    batches = _measured(params, band, method)
    if about.source == "rig":
        batches = [*_on_the_rig(params, band, method), *batches]
    batches = batches or _aimed(params, band, method, repeats=1)

    draws = np.concatenate([batch.draws for batch in batches])
    launcher = simulator(params, band, theta)
    once, again = np.unique(draws, axis=0, return_inverse=True)
    error, discrepancy = params.trials.actuation_error, law_discrepancy(theta)
    predicted = trials.limited(launcher(draws), params.setup.max_force)
    intervals = landing_intervals(launcher, once, samples, error, discrepancy)[again]
    intervals[np.isnan(predicted.landing_y)] = np.nan
    table = trials.table(
        band,
        method,
        batches,
        predicted=predicted,
        intervals=intervals,
        stretch=trials.stretch_of(np.insert(draws, 0, 0, axis=1), fork_width, about.rest_length),
        recorded=trials.recorded_stretch(episode, fork_width, about.rest_length),
    )
    trials.save(table, Path("data/trials", band, f"{method}.parquet"))
    said = [" ".join(filter(None, (g.kind, g.policy, str(len(g.draws))))) for g in batches]
    print(f"{band} {method}: launches: {', '.join(said)}")


def _measured(params: Params, band: str, method: str) -> list[Batch]:
    """The user's launches of the band that say something about the method, if there are any."""
    path = Path("data/trials/measured", f"{band}.csv")
    launches = read_measured(path, method, params.methods) if path.is_file() else []
    if not launches:
        return []
    draws, landing, targets = zip(*((o.draw, o.landing, o.target) for o in launches), strict=True)
    failure = [None if y is not None else "did not land" for y in landing]
    return [Batch.without_flight("measured", None, draws, targets, list(landing), failure)]


def _aimed(params: Params, band: str, method: str, repeats: int) -> list[Batch]:
    """What the method's policies would launch: the plain one, and the robust one if it has one."""
    targets = [target for target in params.trials.targets for _ in range(repeats)]
    folder = Path("data/policies", band, method)
    policies = {"plain": folder}
    if (folder / ROBUST / "policy.onnx").is_file():
        policies["robust"] = folder / ROBUST
    return [
        Batch.without_flight(
            "predicted", name, policy_draws(params.run, path, np.array(targets)), targets
        )
        for name, path in policies.items()
    ]


def _on_the_rig(params: Params, band: str, method: str) -> list[Batch]:
    """Launches of the policies on the virtual rig; equal numbers have equal errors."""
    batches = _aimed(params, band, method, params.trials.repeats)
    seeds = trials.trial_seed(params.trials, np.arange(len(batches[0].draws))).tolist()
    with Pool() as pool:
        launched = [list(pool.map(partial(_launch, band), g.draws, seeds)) for g in batches]
    return [
        Batch(
            kind="virtual",
            policy=batch.policy,
            draws=batch.draws,
            targets=batch.targets,
            landing=[one.landing_y if one.failure is None else None for one in tried],
            failure=[one.failure for one in tried],
            hold_force=[one.hold_force for one in tried],
            flight=[one.flight for one in tried],
        )
        for batch, tried in zip(batches, launched, strict=True)
    ]


def _launch(band: str, draw: np.ndarray, seed: int):
    """One launch in a process of its own: the rig takes seconds, on one core."""
    from pipeline.rig.launch import launch

    return launch(band, load(), draw, seed)


if __name__ == "__main__":
    errors.run(main)
