"""Variants of methods for campaigns: one thing plain, left out or set otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from ruamel.yaml import YAML

from pipeline.base.code import ROOT
from pipeline.identify.posterior import coordinates
from pipeline.identify.search.explore import rollouts_of
from pipeline.params import Params
from pipeline.params.identification import Weights
from validation.campaigns.runner import OURS, PAPER

PRESETS = ROOT / "presets"
LAST = "plain_bo"  # takes as long as all others
# The paper's method under other settings, by names of their own. Of the weights, geometry's is most
# of the loss.
SETTINGS: dict[str, dict] = {
    "cma_8": {"optimizer": {"cma_population": 8}},
    "cma_32": {"optimizer": {"cma_population": 32}},
    "de_storn": {"optimizer": {"mutation": [0.7, 0.9], "recombination": 0.9}},
    "de_half": {"optimizer": {"mutation": [0.4, 0.6], "recombination": 0.9}},
}
WEIGHTS = {
    "geom_quarter": {"geom": 0.25, "force": 1.0, "work": 1.0},
    "force_fourfold": {"geom": 1.0, "force": 4.0, "work": 1.0},
    "work_fourfold": {"geom": 1.0, "force": 1.0, "work": 4.0},
}
# The density with its priors' standard deviations times a factor, and the loss factor's mean too.
PRIOR_CHANGES = {
    "prior_half": (0.5, 1.0),
    "prior_twice": (2.0, 1.0),
    "prior_loss_up": (1.0, 1.4),
    "prior_loss_down": (1.0, 0.6),
}
LAW_CHANGES = "search_rubber", "density_neo_hookean", "no_softening", "no_flow"
BESIDE = {*SETTINGS, *WEIGHTS, *PRIOR_CHANGES, *LAW_CHANGES}  # what no campaign runs unasked
# Gaussian processes of thousands of points cost more than the simulations: a large budget is less.
BAYES, BAYES_LARGE = (
    ("bo", "package_si"),
    {"population": 20, "generations": 8, "cma_rollouts": 2220},
)


def with_variants(params: Params) -> Params:
    """params.yaml's methods, and the paper's with one thing plain or left out."""
    paper, optimizer = params.methods[PAPER], params.optimizer
    names = ("generations", "delta", "cma_population", "recombination")
    starts = {name: getattr(optimizer, name) for name in names}
    low, high = optimizer.mutation
    starts |= {"mutation_low": low, "mutation_high": high}

    def variant(kind: str, **settings):
        search = f"validation.searches:{kind}"
        return paper.model_copy(update={"search": search, "settings": settings})

    methods = dict(params.methods.items()) | {
        "no_covariance_plain": variant("PlainStarts", k_top=optimizer.k_top, **starts),
        "no_covariance_no_multistart_plain": variant("PlainStarts", k_top=1, **starts),
        LAST: variant("SmallBatches"),
        "plain_adam": variant("PlainAdam"),
        "no_clamp_calibration": paper.model_copy(update={"mounting": False}),
    }
    for name, weights in WEIGHTS.items():
        methods[name] = paper.model_copy(update={"weights": Weights(**weights)})
    methods |= dict.fromkeys(SETTINGS, paper)
    density = params.methods[OURS]
    methods |= dict.fromkeys(PRIOR_CHANGES, density)

    def without(**values: float):
        return density.model_copy(update={"fixed": {**density.fixed, **values}})

    rubber, plain = (
        {"law": method.law, "bounds": method.bounds} for method in (density, methods[PAPER])
    )
    methods |= {
        "search_rubber": methods[PAPER].model_copy(update=rubber),
        "density_neo_hookean": density.model_copy(update=plain),
        "no_softening": without(softening=0.0),
        "no_flow": without(flow=0.0, log_flow_rate=0.0),
    }
    return params.model_copy(update={"methods": methods})


def of_job(params: Params, method: str, preset: str | None) -> Params:
    """params.yaml with a preset, and what a method's name stands for, without its new methods."""
    changes = dict(SETTINGS.get(method, {}))
    if preset:
        text = (PRESETS / f"{preset}.yaml").read_text(encoding="utf-8")
        optimizer = YAML(typ="safe").load(text)["optimizer"]
        if method in BAYES:
            optimizer |= BAYES_LARGE
        changes["optimizer"] = optimizer | changes.get("optimizer", {})
    sections = {
        name: type(section).model_validate(section.model_dump() | changes[name])
        for name, section in params
        if name in changes
    }
    return params.model_copy(update=sections)


@contextmanager
def priors_of(method: str) -> Iterator[None]:
    """Within it the density has the priors that a method's name stands for."""
    before = dict(coordinates.PRIORS)
    width, factor = PRIOR_CHANGES.get(method, (1.0, 1.0))
    for name, (mean, spread) in before.items():
        shift = np.log(factor) if name == coordinates.LOGS[coordinates.LOSS] else 0.0
        coordinates.PRIORS[name] = mean + shift, width * spread
    try:
        yield
    finally:
        coordinates.PRIORS.update(before)


def rollouts_of_search(params: Params, method: str) -> int:
    """Rollouts that a method's whole search may have."""
    both = params.methods[method].search == "multistart"
    return rollouts_of(params, method) + (params.optimizer.cma_rollouts if both else 0)
