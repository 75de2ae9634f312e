"""Refine what a search explored, and choose θ*.

    python -m stages.theta band1 sling2sim2real

Reads data/history/<band>/<method>.parquet, data/episodes/<band>/, data/mounting/<band>.json and,
where launches are evidence, data/evidence/<band>.csv. Writes the regions with their covariances to
data/clusters/<band>/<method>.json and what was evaluated to data/refined/<band>/<method>.parquet,
θ* to data/theta/<band>/<method>.json, and samples of what is known of it to
data/confidence/<band>/<method>.json.

By the method's search: `multistart` refines its regions by a CMA-ES in each, and θ* is the best of
all; `least_squares` fits one density to all recordings and launches, θ* is its mode, and it alone
says how sure θ* is: else "confidence" is null and there are no samples. A search of one phase has
no region and no row. Killed, it resumes from .checkpoints/. SLING_DEVICE and SLING_WORKERS say
where it runs.
"""

from __future__ import annotations

from dataclasses import replace

from pipeline.base.files import write_json
from pipeline.base.launch_table import expect_apart
from pipeline.base.layout import Layout, made
from pipeline.base.machine import workers
from pipeline.episode.pull import launch_history
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.evaluate import Evaluator
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.objective.session import load_episode, load_episodes, service
from pipeline.identify.optimizers.cma.multistart import Multistart
from pipeline.identify.posterior import identify
from pipeline.identify.posterior.evidence import read_evidence
from pipeline.identify.results.mounting import sling_of_method
from pipeline.identify.search.history import History, theta_content
from pipeline.identify.search.loop import search
from pipeline.identify.search.regions import Region, regions_of, save_regions
from pipeline.params.identification import LEAST_SQUARES
from pipeline.simulator.parameters import EXTRA, Parameters, searched_names
from pipeline.simulator.rubber import RUBBER
from stages.start import run, started


def main() -> None:
    params, band, method = started("band", "method")
    about, layout = params.methods[method], Layout()
    box = SearchBox.of_method(params, method)
    explored = History.load(method, box.free, made(layout.history(band, method)))
    regions, asked = promising(about, params.optimizer, explored)
    save_regions(layout.clusters(band, method), box.free, regions, asked)
    if about.search == LEAST_SQUARES:
        content, samples = fitted(params, band, method)
    else:
        content, samples = searched(params, band, method, box, regions), {"samples": []}
    write_json(layout.confidence(band, method), samples | {"band": band})
    write_json(layout.theta(band, method), content)
    print(f"{band} {method}: loss {content['loss']['total']:.5g}")
    told = content["confidence"]
    for name, value in content["theta"].items():
        print(f"  {name} {value:.4g}{_trust(told['parameters'][name]) if told else ''}")


def searched(params, band: str, method: str, box: SearchBox, regions: list[Region]) -> dict:
    """The best of all that a search and a CMA-ES in each region evaluated."""
    layout, law = Layout(), params.methods[method].law
    if regions:
        print(
            f"{band} {method}: {len(regions)} regions, best loss {regions[0].loss:.5g}", flush=True
        )
    refine(params, band, method, box, regions).save(layout.refined(band, method))
    sources = layout.history(band, method), layout.refined(band, method)
    history = History.load(method, searched_names(law), *sources)
    known = {"law": RUBBER, "history": launch_history(load_episode(band))} if law == RUBBER else {}
    return theta_content(history, band, known | unmounted(params, method))


def fitted(params, band: str, method: str) -> tuple[dict, dict]:
    """The mode of the density over all evidence, from the best that was explored."""
    layout, box = Layout(), SearchBox.of_method(params, method)
    explored = History.load(method, box.names, layout.history(band, method))
    best = explored.best()
    expect_apart(layout, band)
    sling = sling_of_method(params, band, method)
    found = identify.identify(
        params,
        method,
        sling,
        load_episodes(band),
        Parameters.named(box.law, {name: best[name] for name in box.names}),
        observed=read_evidence(layout.evidence, band, params),
        workers=workers(),
        progress=lambda fit: print(
            f"{band} {method}: expansion {fit.steps}, misfit {fit.misfit:.2f}", flush=True
        ),
    )
    content = identify.theta_content(found, band, method) | unmounted(params, method)
    content["confidence"] = identify.confidence(found, params.parameters)
    content["rollouts"] = len(explored.total) + found.rollouts

    episode, beside = found.recordings[0].episode, found.mode.sample()
    whole = replace(box, fixed={name: beside[name] for name in EXTRA})
    mode = Evaluator(episode, sling, EpisodeLoss.of(params, method, episode, sling), whole)
    history = History(method, box.names)
    history.add(mode(box.unit_of(found.mode)), phase=LEAST_SQUARES, generation=found.fit.steps)
    history.save(layout.refined(band, method))
    told = found.parameters
    samples = {"names": [*told.names], "samples": told.values.tolist()}
    return theta_content(history, band, content), samples


def refine(params, band: str, method: str, box: SearchBox, regions: list[Region]) -> History:
    """What a CMA-ES in each region evaluates; no row where there is no region."""
    optimizer, history = params.optimizer, History(method, box.names)
    if regions:
        search(
            Multistart(regions, population=optimizer.cma_population, seed=optimizer.seed),
            service("refined", band, method, params, optimizer.cma_rollouts),
            history,
            rollouts=optimizer.cma_rollouts,
            box=box,
        )
    return history


def promising(about, optimizer, explored: History) -> tuple[list[Region], int]:
    """Regions of a history and how many were asked for; none where the search has one phase."""
    if about.search != "multistart":
        return [], 0
    explored.best()  # says why, where all failed
    return regions_of(about, optimizer, explored)


def unmounted(params, method: str) -> dict:
    """What a θ file says where the method leaves out the calibration of the clamps."""
    return {} if params.methods[method].mounting else {"mounted": False}


def _trust(about: dict) -> str:
    if about.get("fixed"):
        return " (fixed)"
    word = "" if about["identifiable"] else ", not identifiable"
    return f" ({about['low']:.4g} to {about['high']:.4g}{word})"


if __name__ == "__main__":
    run(main)
