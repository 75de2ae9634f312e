"""Predict what the policy of one band and method launches, beside what it led to.

    python -m stages.trials band1 paper

Reads data/policies/, data/theta/, data/confidence/, data/clamps/ and data/episodes/, and the
band's data/launches/<band>/scores.json; writes data/trials/<band>/<method>.parquet. A rig band has
launches of the rig beside its policy. For a recorded band the calibrated simulator predicts the
measured launches, or else the policy's own.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.base.layout import Layout
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_samples, load_theta, parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials import trials
from sling2sim2real.launching.trials.measured import load_scores
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    band_params, fork_width = params.bands[band], params.setup.fork_width
    layout = Layout()
    theta = load_theta(layout.theta(band, method), band)
    samples = load_samples(layout.confidence(band, method), parameters_of(theta))
    episodes = Episode.load_all(layout.episodes(band))

    batches = trials.scored(load_scores(layout.scores(band)), method)
    if band_params.source == "rig":
        batches = [trials.Batch.load(layout.launches(band, method)), *batches]
    batches = batches or [trials.aimed(Stored(band, method), list(params.trials.targets))]

    launcher = simulator(params, band, theta)
    launches, intervals = trials.predict(batches, launcher, samples, params)
    draws = np.concatenate([batch.draws for batch in batches])
    table = trials.table(
        band,
        method,
        batches,
        predicted=launches,
        intervals=intervals,
        stretch=stretch_of(np.insert(draws, 0, 0, axis=1), fork_width, band_params.rest_length),
        recorded=recorded_stretch(episodes, fork_width, band_params.rest_length),
    )
    trials.save(table, layout.trials(band, method))
    counts = [f"{batch.kind} {len(batch.draws)}" for batch in batches]
    print(f"{band} {method}: launches: {', '.join(counts)}")


if __name__ == "__main__":
    run(main)
