"""Variants of the paper's method for the ablations, and budgets of presets."""

from __future__ import annotations

from ruamel.yaml import YAML

from pipeline.layout import ROOT
from pipeline.params import Params
from sling2sim2real.identification.search import rollouts_of
from sling2sim2real.settings.identification import POSTERIOR
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.campaigns.runner import PAPER

PRESETS = ROOT / "presets"
# Gaussian processes of thousands of points cost more than the simulations: a large budget is less.
BAYES, BAYES_LARGE = (
    ("bo", "package_si"),
    {"population": 20, "generations": 8, "cma_rollouts": 2220},
)


def with_variants(params: Params) -> Params:
    """params.yaml's methods, and the paper's with the neo-Hookean law."""
    other = params.methods[PAPER].model_copy(update={"law": NEO_HOOKEAN})
    methods = dict(params.methods.items()) | {NEO_HOOKEAN: other}
    return params.model_copy(update={"methods": methods})


def with_preset(params: Params, method: str, preset: str | None) -> Params:
    """params.yaml with a preset's keys of `optimizer`, as a method has them.

    The posterior steps until it has converged, whatever its exploration: it has no such budget.
    """
    if preset is None or params.methods[method].search == POSTERIOR:
        return params
    text = (PRESETS / f"{preset}.yaml").read_text(encoding="utf-8")
    changes = YAML(typ="safe").load(text)["optimizer"]
    if method in BAYES:
        changes |= BAYES_LARGE
    optimizer = params.optimizer
    optimizer = type(optimizer).model_validate(optimizer.model_dump() | changes)
    return params.model_copy(update={"optimizer": optimizer})


def rollouts_of_search(params: Params, method: str) -> int:
    """Rollouts that a method's whole search may have."""
    both = params.methods[method].search == "multistart"
    return rollouts_of(params, method) + (params.optimizer.cma_rollouts if both else 0)
