"""Fit one density to all recordings of a band and to the launches that are evidence.

    python -m stages.density band1 least_squares

Starts at the best point of data/history/<band>/<method>.parquet. Reads data/episodes/<band>/,
data/clamps/<band>.json and data/launches/<band>/observed.json. Writes the exploration and the mode
to data/evaluations/<band>/<method>.parquet; intervals, and samples of them, to
data/confidence/<band>/<method>.json.
"""

from __future__ import annotations

from pipeline.base.layout import Layout, made
from pipeline.base.machine import workers
from pipeline.identify.density import entries_of, evaluated_mode
from pipeline.identify.objective.session import load_episodes
from pipeline.identify.posterior.evidence import load_observed
from pipeline.identify.posterior.identify import fit_posterior
from pipeline.identify.results.confidence_file import save_confidence
from pipeline.identify.results.mounting import sling_of_method
from pipeline.identify.search.evaluations import Evaluations
from pipeline.params.identification import parameter_names
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
