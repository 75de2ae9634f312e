"""Search the box of parameters by one search alone, to the end.

    python -m stages.search band1-real2sim2real

Reads data/episodes/ and data/clamps/ of the pair's recording; writes everything evaluated to
data/evaluations/<pair>.parquet, and data/confidence/<pair>.json, which has no samples. Killed, it
begins anew. SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

from pipeline.layout import Layout
from sling2sim2real.episode.episode import Episode
from sling2sim2real.episode.pull import launch_history
from sling2sim2real.identification.objective.evaluate import logging_evaluator
from sling2sim2real.identification.results.theta import law_entries, save_confidence
from sling2sim2real.identification.search import explore, rollouts_of
from stages.start import pair_of_stage, run


def main() -> None:
    params, pair = pair_of_stage()
    layout, rollouts = Layout(), rollouts_of(params, pair.method)
    episode = Episode.load(layout.episode(pair))
    recorded = pair.band, pair.method, episode, layout.clamps(pair)
    evaluate = logging_evaluator(f"search-{pair.key}", params, *recorded, rollouts)
    explore(params, pair.method, evaluate).save(layout.evaluations(pair))
    method = params.methods[pair.method]
    entries = law_entries(method.law, launch_history(episode))
    save_confidence(layout.confidence(pair), pair.band, entries, mounting=method.mounting)


if __name__ == "__main__":
    run(main)
