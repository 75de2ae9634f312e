"""Fit one density to all episodes of a recording and to the launches that are to fit.

    python -m stages.posterior band1-posterior

Starts at the best point of data/history/<pair>.parquet. Reads data/episodes/ and data/clamps/ of
the pair's recording, and data/launches/<band>.csv. Writes the exploration and the mode to
data/evaluations/<pair>.parquet; intervals, and samples of them, to data/confidence/<pair>.json.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.files import made
from sling2sim2real.base.launches_file import read_launches
from sling2sim2real.base.machine import workers
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.posterior.confidence import (
    confidence,
    evaluated_mode,
    theta_entries,
)
from sling2sim2real.identification.posterior.identify import fit_posterior
from sling2sim2real.identification.posterior.launches import Evidence, observed
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.results.theta import save_confidence, sling_of_method
from sling2sim2real.simulator.model import LaunchSetup
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    layout, method = Layout(), pair.method
    law, mounting = params.methods[method].law, params.methods[method].mounting
    explored = Evaluations.load(method, made(layout.history(pair)))
    sling = sling_of_method(params, pair.band, method, layout.clamps(pair))
    episodes = Episode.load_all(layout.episodes(pair))
    rows = read_launches(made(layout.launches(pair.band)))
    seen = observed(rows, params.trials.actuation_error)
    evidence = Evidence(seen, LaunchSetup.of(params.setup, params.sling)) if seen else None
    density = fit_posterior(
        params,
        method,
        sling,
        episodes,
        explored.best_parameters(law),
        evidence=evidence,
        workers=workers(),
        progress=lambda fit: print(
            f"{pair.key}: expansion {fit.steps}, misfit {fit.misfit:.2f}", flush=True
        ),
    )
    mode = evaluated_mode(params, method, sling, episodes[0], density)
    explored.followed_by(mode).save(layout.evaluations(pair))
    entries = theta_entries(density) | {
        "confidence": confidence(density),
        "rollouts": len(explored.total) + density.rollouts,
    }
    save_confidence(
        layout.confidence(pair), pair.band, entries, density.parameters, mounting=mounting
    )


if __name__ == "__main__":
    run(main)
