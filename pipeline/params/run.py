"""What params.yaml says of a run: which bands and methods it works through."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated

from pydantic import model_validator

from sling2sim2real.base.schema import FILLED, LIST, Names, Range, Section, refusal
from sling2sim2real.settings.identification import MethodParams, steps_of
from sling2sim2real.settings.launches import Nodes


class StepParams(Section):
    """The methods that go through a step of their search, by the step's stage in dvc.yaml.

    They follow from `methods.<name>.search`, which DVC cannot look up.
    """

    history: Names
    clusters: Names
    density: Names
    de: Names
    bo: Names
    adam: Names
    search: Names


class Ablations(Section):
    """Methods that run on some bands only."""

    bands: Names
    rig: Names
    methods: Names
    steps: StepParams


class RunParams(Section):
    bands: Annotated[Names, FILLED]
    rig: Names
    own: Names
    dips: Names
    methods: Annotated[Names, FILLED]
    steps: StepParams
    own_steps: StepParams
    ablations: Ablations

    @model_validator(mode="after")
    def _nothing_runs_twice(self) -> RunParams:
        for method in self.ablations.methods:
            if method in self.methods:
                raise refusal(f"ablations.methods: {method} is one of run.methods already")
        for key, bands in (("own", self.own), ("dips", self.dips)):
            for band in bands:
                if band in self.bands:
                    raise refusal(f"{key}: {band} is one of run.bands already")
        return self


class FloorParams(Section):
    """How far launches of an oracle policy miss: what no method can help."""

    map_size: Annotated[tuple[Nodes, Nodes], LIST]
    launches: Annotated[int, Range(0, 10_000)]  # a target, beside those with the trials' errors


def methods_by_step(
    methods: Iterable[str], methods_params: Mapping[str, MethodParams]
) -> dict[str, list]:
    """What `run.steps` must hold for `methods`, each of which is in `known`."""
    by_step: dict[str, list] = {step: [] for step in StepParams.model_fields}
    for name in methods:
        for step in steps_of(methods_params[name].search):
            if step in by_step:  # `cma` has the list of `clusters`
                by_step[step].append(name)
    return by_step
