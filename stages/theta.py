"""Refine a search's promising regions, choose θ*, the best of all, and say how sure it is.

    python -m stages.theta band1 sling2sim2real

Reads data/history/<band>/<method>.parquet, data/episodes/<band>/ and data/mounting/<band>.json.
Writes the regions with their covariances to data/clusters/<band>/<method>.json and what a CMA-ES in
each evaluated to data/refined/<band>/<method>.parquet (of a search of one phase, no region and no
row); θ* to data/theta/<band>/<method>.json, and samples of the posterior with profile curves to
data/confidence/<band>/<method>.json. Where too many simulations around θ* fail to tell how sure it
is, "confidence" is null and there are no samples. Killed, it resumes from .checkpoints/.
SLING_DEVICE and SLING_WORKERS say where it runs.
"""

from __future__ import annotations

import sys

from pipeline.base.files import write_json
from pipeline.base.layout import Layout, made
from pipeline.base.machine import workers
from pipeline.confidence.rounds import NoConfidence
from pipeline.confidence.summary import confidence
from pipeline.episode.pull import launch_history
from pipeline.objective.session import load_episode, service
from pipeline.objective.space import Space
from pipeline.params.identification import LAWS
from pipeline.search.history import History, theta_content
from pipeline.search.loop import Free, search
from pipeline.search.optimizers.multistart import Multistart
from pipeline.search.regions import Region, regions_of, save_regions
from pipeline.sling.load import load_sling
from pipeline.sling.material import THETA
from pipeline.sling.rubber import RUBBER
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, layout = params.methods[method], Layout()
    free = Free.of(Space.of_method(params, method), about.fixed)
    explored = History.load(method, free.names, made(layout.history(band, method)))
    regions, asked = promising(about, params.optimizer, explored)
    episode, sling = load_episode(band), load_sling(params, band, law=about.law)
    known = {"law": RUBBER, "history": launch_history(episode)} if about.law == RUBBER else {}

    save_regions(layout.clusters(band, method), free.names, regions, asked)
    if regions:
        fewer = f" (k_top asks for {asked})" if len(regions) < asked else ""
        best = f"best loss {regions[0].loss:.5g}"
        print(f"{band} {method}: {len(regions)} regions{fewer}, {best}", flush=True)
    refine(params, band, method, free, regions).save(layout.refined(band, method))

    sources = layout.history(band, method), layout.refined(band, method)
    history = History.load(method, (*THETA, *LAWS[about.law]), *sources)
    content = theta_content(history, band, known)
    try:
        told, kept = confidence(params, method, episode, sling, content, workers=workers())
    except NoConfidence as error:  # θ* is what it is, and all that follows does without
        print(f"warning: {method}: {error}", file=sys.stderr)
        told, kept = None, {"samples": []}
    content["confidence"] = told
    write_json(layout.confidence(band, method), kept | {"band": band})
    write_json(layout.theta(band, method), content)
    print(f"{band} {method}: loss {content['loss']['total']:.5g}")
    for name, value in content["theta"].items():
        print(f"  {name} {value:.4g}{_trust(told['parameters'][name]) if told else ''}")


def refine(params, band: str, method: str, free: Free, regions: list[Region]) -> History:
    """What a CMA-ES in each region evaluates; no row where there is no region."""
    optimizer, history = params.optimizer, History(method, Space.of_method(params, method).names)
    if regions:
        search(
            Multistart(regions, population=optimizer.cma_population, seed=optimizer.seed),
            service("refined", band, method, params, optimizer.cma_rollouts),
            history,
            rollouts=optimizer.cma_rollouts,
            free=free,
        )
    return history


def promising(about, optimizer, explored: History) -> tuple[list[Region], int]:
    """Regions of a history and how many were asked for; none where the search has one phase."""
    if about.search != "multistart":
        return [], 0
    explored.best()  # says why, where all failed
    return regions_of(about, optimizer, explored)


def _trust(about: dict) -> str:
    if about.get("fixed"):
        return " (fixed)"
    word = "" if about["identifiable"] else ", not identifiable"
    return f" ({about['low']:.4g} to {about['high']:.4g}{word})"


if __name__ == "__main__":
    run(main)
