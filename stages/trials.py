"""Launch with the policies of one band and method, and predict what is launched.

    python -m stages.trials band1 sling2sim2real

Reads data/policies/, data/theta/, data/confidence/ and data/episodes/, and
data/trials/measured/<band>.csv where it is there; writes data/trials/<band>/<method>.parquet.
A rig band is launched on the virtual rig, with the same errors for every method and policy. For a
recorded band the calibrated simulator predicts the measured launches, or else the policies' own.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from pipeline.base.launch_table import expect_apart
from pipeline.base.layout import Layout
from pipeline.episode.episode import Episode
from pipeline.identify.results.theta import load_samples, load_theta, parameters_of
from pipeline.launching.surface.simulator import simulator
from pipeline.launching.surface.stored import Stored
from pipeline.launching.trials import trials
from pipeline.launching.trials.stretch import recorded_stretch, stretch_of
from pipeline.params import load
from rig.physics.launch import Trial, launch
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, fork_width = params.bands[band], params.setup.fork_width
    layout = Layout()
    theta = load_theta(layout.theta(band, method), band)
    samples = load_samples(layout.confidence(band, method), parameters_of(theta))
    episodes = Episode.load_all(layout.episodes(band))

    expect_apart(layout, band)
    stored, targets = Stored(band, method), params.trials.targets
    batches = trials.measured(params, band, method, layout.measured)
    if about.source == "rig":
        own = trials.aimed(stored, np.repeat(targets, params.trials.repeats).tolist())
        batches = [trials.launched(own, partial(_launch, band)), *batches]
    batches = batches or [trials.aimed(stored, list(targets))]

    launcher = simulator(params, band, theta)
    launches, intervals = trials.predict(batches, launcher, samples, params)
    draws = np.concatenate([batch.draws for batch in batches])
    table = trials.table(
        band,
        method,
        batches,
        predicted=launches,
        intervals=intervals,
        stretch=stretch_of(np.insert(draws, 0, 0, axis=1), fork_width, about.rest_length),
        recorded=recorded_stretch(episodes, fork_width, about.rest_length),
    )
    trials.save(table, layout.trials(band, method))
    counts = [f"{batch.kind} {len(batch.draws)}" for batch in batches]
    print(f"{band} {method}: launches: {', '.join(counts)}")


def _launch(band: str, draw: np.ndarray, number: int) -> Trial:
    """A launch in a process of its own, which reads the parameters: they cannot be sent there."""
    return launch(band, load(), draw, number)


if __name__ == "__main__":
    run(main)
