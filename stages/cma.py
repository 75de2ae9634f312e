"""Refine the regions of an exploration by a CMA-ES in each.

    python -m stages.cma band1-paper

Reads data/history/ and data/clusters/ of the pair, and data/episodes/ and data/clamps/ of its
recording; writes everything evaluated, the exploration too, to data/evaluations/<pair>.parquet, and
data/confidence/<pair>.json, which has no samples. Killed, it begins anew. SLING_DEVICE and
SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.base.files import made
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.objective.evaluate import logging_evaluator
from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.results.theta import law_entries, save_confidence
from sling2sim2real.identification.searches.cma_es import refine
from sling2sim2real.identification.searches.regions import load_regions
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    method, layout = pair.method, Layout()
    law, mounting = params.methods[method].law, params.methods[method].mounting
    regions, _ = load_regions(made(layout.clusters(pair)))
    explored = Evaluations.load(method, made(layout.history(pair)))
    episode, rollouts = Episode.load(layout.episode(pair)), params.optimizer.cma_rollouts
    recorded = pair.band, method, episode, layout.clamps(pair)
    evaluate = logging_evaluator(f"cma-{pair.key}", params, *recorded, rollouts)
    refined = refine(params, method, regions, evaluate)
    explored.followed_by(refined).save(layout.evaluations(pair))
    entries = law_entries(law, launch_history(episode))
    save_confidence(layout.confidence(pair), pair.band, entries, mounting=mounting)


if __name__ == "__main__":
    run(main)
