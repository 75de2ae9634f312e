"""Fit one density to all recordings of a band and to the launches that are evidence.

    python -m stages.density band1 least_squares

Starts at the best point of data/history/<band>/<method>.parquet. Reads data/episodes/<band>/,
data/clamps/<band>.json and data/launches/<band>/observed.json. Writes the exploration and the mode
to data/evaluations/<band>/<method>.parquet; intervals, and samples of them, to
data/confidence/<band>/<method>.json.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout, made
from sling2sim2real.base.machine import workers
from sling2sim2real.identification.density import entries_of, evaluated_mode
from sling2sim2real.identification.evaluations import Evaluations
from sling2sim2real.identification.objective.session import load_episodes
from sling2sim2real.identification.posterior.evidence import load_observed
from sling2sim2real.identification.posterior.identify import fit_posterior
from sling2sim2real.identification.results.confidence_file import save_confidence
from sling2sim2real.identification.results.mounting import sling_of_method
from sling2sim2real.settings.identification import parameter_names
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    layout, law = Layout(), params.methods[method].law
    explored = Evaluations.load(method, parameter_names(law), made(layout.history(band, method)))
    sling, episodes = sling_of_method(params, band, method), load_episodes(band)
    evidence = load_observed(layout.observed(band))
    density = fit_posterior(
        params,
        method,
        sling,
        episodes,
        explored.best_parameters(law),
        evidence=evidence,
        workers=workers(),
        progress=lambda fit: print(
            f"{band} {method}: expansion {fit.steps}, misfit {fit.misfit:.2f}", flush=True
        ),
    )
    mode = evaluated_mode(params, method, sling, episodes[0], density)
    explored.followed_by(mode).save(layout.evaluations(band, method))
    entries, samples = entries_of(density, explored), density.parameters
    entries["made_with"] = evidence.made_with if evidence else {}
    save_confidence(layout.confidence(band, method), band, entries, samples)


if __name__ == "__main__":
    run(main)
