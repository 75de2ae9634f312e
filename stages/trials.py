"""Launch with a policy, on the rig where that has its band, and predict where launches land.

    python -m stages.trials band1-paper

Reads data/policies/, data/theta/ and data/confidence/ of the pair, data/clamps/ and data/episodes/
of its recording, and data/launches/<band>.csv, whose launches to check are trials too; writes
data/trials/<pair>.parquet. Launches on the rig of equal target and number have the same errors, for
every method and policy. Without any launch the simulator predicts the policy's own.
"""

from __future__ import annotations

from collections import Counter
from functools import partial

import numpy as np
from pyarrow import parquet

from pipeline.layout import Layout
from pipeline.params import load
from rig.physics.launch import Trial, launch
from sling2sim2real.base.files import replacing
from sling2sim2real.base.launches_file import read_launches
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.results.theta import load_samples, load_theta, parameters_of
from sling2sim2real.launching.surface.simulator import simulator
from sling2sim2real.launching.surface.stored import Stored
from sling2sim2real.launching.trials import trials
from sling2sim2real.launching.trials.stretch import recorded_stretch, stretch_of
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    band_params = params.bands[pair.band]
    layout = Layout()
    theta = load_theta(layout.theta(pair), pair.band)
    samples = load_samples(layout.confidence(pair), parameters_of(theta))
    episodes = Episode.load_all(layout.episodes(pair))
    stored = Stored(layout.policy(pair))

    rows = trials.scored(read_launches(layout.launches(pair.band)), pair.method)
    if band_params.source == "rig":
        targets = np.repeat(params.trials.targets, params.trials.repeats).tolist()
        aimed = trials.aimed(stored, targets)
        rows = [*trials.launch_virtually(aimed, partial(_launch, pair.band)), *rows]
    rows = rows or trials.aimed(stored, params.trials.targets)

    launcher = simulator(params, pair.band, theta, layout.clamps(pair))
    rows = trials.predicted(rows, launcher, samples, params)
    sizes = params.setup.fork_width, band_params.rest_length
    places = np.insert(trials.draws_of(rows), 0, 0, axis=1)
    table = trials.table(
        rows,
        stretch_of(places, *sizes),
        band=pair.band,
        method=pair.method,
        recorded_stretch=recorded_stretch(episodes, *sizes),
    )
    with replacing(layout.trials(pair)) as temporary:
        parquet.write_table(table, temporary)
    counts = Counter(row["kind"] for row in rows)
    print(f"{pair.key}: launches: {', '.join(f'{kind} {n}' for kind, n in counts.items())}")


def _launch(band: str, draw: np.ndarray, number: int) -> Trial:
    """A launch in a process of its own, which reads the parameters: they cannot be sent there."""
    return launch(band, load(), draw, number)


if __name__ == "__main__":
    run(main)
