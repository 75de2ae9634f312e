"""Search the box of parameters with one optimiser, to the end.

    python -m stages.search band1 real2sim2real

The stages `de`, `bo`, `adam` and `search` of dvc.yaml run it, each for the methods that search so.
Reads data/episodes/<band>/ and data/clamps/<band>.json; writes everything evaluated to
data/evaluations/<band>/<method>.parquet, and data/confidence/<band>/<method>.json, which has no
samples. Killed, it begins anew. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from sling2sim2real.base.layout import Layout
from sling2sim2real.identification.objective.session import load_episode, logging_evaluator
from sling2sim2real.identification.results.confidence_file import law_entries, save_confidence
from sling2sim2real.identification.search import explore, rollouts_of
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    layout, rollouts = Layout(), rollouts_of(params, method)
    evaluations = explore(
        params, method, logging_evaluator("search", band, method, params, rollouts)
    )
    evaluations.save(layout.evaluations(band, method))
    entries = law_entries(load_episode(band), params.methods[method].law)
    save_confidence(layout.confidence(band, method), band, entries)


if __name__ == "__main__":
    run(main)
