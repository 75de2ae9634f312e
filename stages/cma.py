"""Refine the regions of an exploration by a CMA-ES in each.

    python -m stages.cma band1 sling2sim2real

Reads data/history/ and data/clusters/ of the method, data/episodes/<band>/ and
data/clamps/<band>.json; writes everything evaluated, the exploration too, to
data/evaluations/<band>/<method>.parquet, and data/confidence/<band>/<method>.json, which has no
samples. Killed, it begins anew. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout, made
from sling2sim2real.identification.evaluations import Evaluations
from sling2sim2real.identification.objective.session import load_episode, logging_evaluator
from sling2sim2real.identification.results.confidence_file import law_entries, save_confidence
from sling2sim2real.identification.searches.cma_es import refine
from sling2sim2real.identification.searches.regions import load_regions
from sling2sim2real.settings.identification import parameter_names
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    law, layout = params.methods[method].law, Layout()
    regions, _ = load_regions(made(layout.clusters(band, method)))
    names = parameter_names(law)
    explored = Evaluations.load(method, names, made(layout.history(band, method)))
    evaluate = logging_evaluator("cma", band, method, params, params.optimizer.cma_rollouts)
    refined = refine(params, method, regions, evaluate)
    explored.followed_by(refined).save(layout.evaluations(band, method))
    save_confidence(layout.confidence(band, method), band, law_entries(load_episode(band), law))


if __name__ == "__main__":
    run(main)
