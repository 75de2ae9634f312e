"""Explore the whole box of parameters; keep everything evaluated.

    python -m stages.history band1-paper

By differential evolution for a multistart, by one design for the posterior, which is fitted from
its best point. Reads data/episodes/ and data/clamps/ of the pair's recording; writes
data/history/<pair>.parquet. Killed, it begins anew. SLING_DEVICE and SLING_WORKERS say where it
runs.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.episode.episode import Episode
from sling2sim2real.identification.objective.evaluate import logging_evaluator
from sling2sim2real.identification.search import explore, rollouts_of
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    layout, rollouts = Layout(), rollouts_of(params, pair.method)
    recorded = pair.band, pair.method, Episode.load(layout.episode(pair)), layout.clamps(pair)
    evaluate = logging_evaluator(f"history-{pair.key}", params, *recorded, rollouts)
    explore(params, pair.method, evaluate).save(layout.history(pair))


if __name__ == "__main__":
    run(main)
