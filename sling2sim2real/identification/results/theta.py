"""θ files: the identified parameters of a band as JSON, or the same written by hand.

{"band": "...", "theta": {"youngs_modulus": ..., ... all five}}  is of the neo-Hookean law; with
"law": "rubber", θ has its parameters too and "history" {"pull_time", "pause", "deepest"} says in
how many seconds the recording's hand drew the band, how long it waited [s], and how far the band
had ever been drawn [m]. Where a stage wrote it, also "method", "nuisances": {"air_drag": ...},
"turn_damping", "returned_share", "loss": {"geom", "force", "work", "total"}, "rollouts" and how
many of them "failed", by which phase, generation and solver it was "found", "confidence";
"mounted": false where the method leaves out the calibration of the clamps; "made_with": the
settings of params.yaml that it rests on (params/provenance.py). What is read of "confidence":
confidence.py.

What its confidence rests on, samples of θ, lies beside in data/confidence/.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import create_model, model_validator

from sling2sim2real.base.errors import printable
from sling2sim2real.base.layout import NotMade
from sling2sim2real.base.parameters import TABLE, Parameter
from sling2sim2real.base.schema import JsonRecord, Name, Range, Section, read_json, refusal
from sling2sim2real.identification.results.confidence import Confidence, Count
from sling2sim2real.identification.results.mounting import load_sling
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LAWS, Law, parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import EXTRA, THETA, Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER

REACH = {row.name: row.reach for row in TABLE if isinstance(row, Parameter)}


def _field(row: Parameter) -> Any:
    kind = Annotated[float, Range(*row.reach)]
    return kind if row.default is None else (kind, row.default)


_FIELDS: dict[str, Any] = {
    row.name: _field(row)
    for row in TABLE
    if isinstance(row, Parameter) and (row.name in THETA or row.law)
}


class ThetaValues(create_model("_ThetaValues", __base__=Section, **_FIELDS)):
    """The five, and what the law adds."""


class Nuisances(Section):
    air_drag: Annotated[float, Range(*REACH["air_drag"])] | None = None


class RecordedPull(Section):
    pull_time: Annotated[float, Range(0.01, 1000)]
    pause: Annotated[float, Range(0, 1e5)]
    deepest: Annotated[float, Range(0, 10)] = 0.0


class ThetaFile(JsonRecord):
    band: str
    law: Law = "neo_hookean"
    theta: ThetaValues
    history: RecordedPull | None = None
    nuisances: Nuisances = Nuisances()
    turn_damping: Annotated[float, Range(*REACH["turn_damping"])] = 0.0
    returned_share: Annotated[float, Range(*REACH["returned_share"])] = 1.0
    mounted: bool = True
    loss: dict[Name, float] = {}
    rollouts: Count = 0
    made_with: dict[str, Any] = {}
    confidence: Confidence | None = None

    @model_validator(mode="after")
    def _keys_of_its_law(self) -> ThetaFile:
        wanted, given = set(LAWS[self.law]), self.theta.model_fields_set - {*THETA}
        if wanted != given:
            names = ", ".join((*THETA, *LAWS[self.law]))
            raise refusal(f"theta: of the law {self.law} it must have exactly {names}")
        if self.law == RUBBER and self.history is None:
            raise refusal("history: {pull_time, pause} is missing, which the law rubber needs")
        return self


class PosteriorFile(JsonRecord):
    """What a θ file's confidence rests on; no samples where it has none."""

    names: list[str] = []
    samples: list[list[float]]

    @model_validator(mode="after")
    def _a_column_each(self) -> PosteriorFile:
        complete = self.names in [
            [*THETA, *law, *EXTRA[:count]]
            for law in LAWS.values()
            for count in range(len(EXTRA) + 1)
        ]
        if self.samples and not (complete and {*map(len, self.samples)} == {len(self.names)}):
            raise refusal("samples: must have a column for each of `names`, which are those of θ")
        return self


def load_theta(path: Path, band: str) -> dict:
    """Read and check a θ file. Raises NotMade."""
    content = read_json(path, ThetaFile)
    if content.band != band:
        raise NotMade(path, f'band: must be "{band}", got "{printable(content.band[:60])}"')
    return content.model_dump(exclude_unset=True)


def load_samples(path: Path, theta: Parameters) -> Parameters | None:
    """Samples of what is known of `theta`, whose values they take where they have no column.

    None without any. Raises NotMade where the file is damaged, or of another law.
    """
    file = read_json(path, PosteriorFile) if path.is_file() else PosteriorFile(samples=[])
    if not file.samples:
        return None
    columns = dict(zip(file.names, np.array(file.samples, float).T, strict=True))
    if {*columns} - {*EXTRA} != {*parameter_names(theta.law)}:
        raise NotMade(path, f"names: must be those of the law {theta.law}, as its θ file is")
    return Parameters.named(theta.law, columns, theta.sample())


def calibrated(params: Settings, band: str, content: dict, clamps: Path | None) -> ClampedBand:
    """The band that a θ file's content is of: of its law, with its clamps calibrated or not."""
    law, mounted = content.get("law", NEO_HOOKEAN), content.get("mounted", True)
    return load_sling(params, band, clamps, law, mounted=mounted)


def launch_setup(params: Settings, content: dict) -> LaunchSetup:
    """How the band of a θ file is launched."""
    return LaunchSetup.of(params.setup, params.sling, history_of(params, content))


def history_of(params: Settings, content: dict) -> LaunchHistory | None:
    """How a hand must draw the band of a θ file to launch it; None for a law without memory.

    As params.yaml's `launch` says, or else as the recording's hand did.
    """
    requested = {"pull_time": params.launch.pull_time, "pause": params.launch.pause}
    if content.get("law", NEO_HOOKEAN) != RUBBER:
        return None
    stated = {name: value for name, value in requested.items() if value is not None}
    return LaunchHistory(**content["history"] | stated)


def parameters_of(content: dict) -> Parameters:
    """One sample: what a θ file's content says of its material."""
    return Parameters.named(
        content.get("law", NEO_HOOKEAN),
        {
            **content["theta"],
            "air_drag": content.get("nuisances", {}).get("air_drag") or 0.0,
            "turn_damping": content.get("turn_damping", 0.0),
            "returned_share": content.get("returned_share", 1.0),
        },
    )


def content_of(parameters: Parameters, history: LaunchHistory | None = None) -> dict:
    """What a θ file says of one sample; the inverse of `parameters_of`.

    Args:
        history: Of the recording's hand, which a law with memory needs.
    """
    values, law = parameters.sample(), parameters.law
    return {
        **({} if law == NEO_HOOKEAN else {"law": law}),
        **({"history": history and vars(history)} if law == RUBBER else {}),
        "theta": {name: values[name] for name in parameter_names(law)},
        "nuisances": {"air_drag": values["air_drag"]},
        "turn_damping": values["turn_damping"],
        "returned_share": values["returned_share"],
    }
