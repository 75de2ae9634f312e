"""θ files, and what lies beside them as JSON: how the clamps are, and samples of the posterior.

A θ file has the identified parameters of a band, as a stage wrote them or by hand:

{"band": "...", "theta": {"youngs_modulus": ..., ... all five}}  is of the neo-Hookean law; with
"law": "rubber", θ has its parameters too and "history" {"pull_time", "pause", "deepest"} says in
how many seconds the recording's hand drew the band, how long it waited [s], and how far the band
had ever been drawn [m]. Where a stage wrote it, also "method", "nuisances": {"air_drag": ...},
"turn_damping", "returned_share", "loss": {"geom", "force", "work", "total"}, "rollouts" and how
many of them "failed", by which phase, generation and solver it was "found", "confidence";
"mounted": false where the method leaves out the calibration of the clamps.

As much of "confidence" is modelled here as is read: a file edited by hand is refused in one line,
not where it is used. What it rests on, samples of θ, lies beside in data/confidence/ with
"estimate": what a search says of θ beside its evaluations.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, create_model, model_validator

from sling2sim2real.base.errors import printable
from sling2sim2real.base.files import NotMade, write_json
from sling2sim2real.base.parameters import TABLE, Parameter
from sling2sim2real.base.schema import (
    FILLED,
    LIST,
    Direction,
    JsonRecord,
    Name,
    Range,
    Section,
    read_json,
    refusal,
)
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import LAWS, Law, parameter_names
from sling2sim2real.simulator.model import ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import EXTRA, THETA, Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN, RUBBER

Count = Annotated[int, Field(ge=0)]
Unit = Annotated[str, Field(pattern=r"^[A-Za-z0-9/%]{0,12}$")]
BOUNDS = {row.name: row.reach for row in TABLE if isinstance(row, Parameter)}


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
    air_drag: Annotated[float, Range(*BOUNDS["air_drag"])] | None = None


class RecordedPull(Section):
    pull_time: Annotated[float, Range(0.01, 1000)]
    pause: Annotated[float, Range(0, 1e5)]
    deepest: Annotated[float, Range(0, 10)] = 0.0


class ParameterInterval(JsonRecord):
    low: float
    high: float
    identifiable: bool
    prior: Annotated[tuple[float, float], LIST] | None = None


class DerivedQuantity(JsonRecord):
    value: float
    low: float
    high: float
    unit: Unit = ""


class EpisodeSource(JsonRecord):
    file: str = "?"
    pull: int = 1


class RecordingResiduals(JsonRecord):
    """Root mean squares [N, m, m]; seconds after the release of the pictures of the recoil."""

    force_rms: float
    held_rms: float
    recoil_rms: float
    pictures: list[float]
    source: EpisodeSource = EpisodeSource()
    misfit_without: float | None = None


class LaunchResidual(JsonRecord):
    draw: Annotated[tuple[float, float], LIST]
    measured: dict[Name, float]
    left: dict[Name, float | None]
    z_without_it: dict[Name, float | None]


class CorrelationMatrix(JsonRecord):
    names: list[Name]
    matrix: list[list[float]]

    @model_validator(mode="after")
    def _is_square(self) -> CorrelationMatrix:
        count = len(self.names)
        if [*map(len, self.matrix)] != [count] * count:
            raise refusal(f"matrix: must have {count} rows of {count} numbers")
        return self


class Confidence(JsonRecord):
    parameters: dict[Name, ParameterInterval]
    derived: dict[Name, DerivedQuantity]
    recordings: Annotated[list[RecordingResiduals], FILLED]
    settled: bool
    edges: dict[Name, Literal["lower", "upper"]] = {}
    steps: Count = 0
    effective_samples: float | None = None
    disagreement: float = 1.0
    correlation: CorrelationMatrix | None = None
    launches: list[LaunchResidual] = []

    @model_validator(mode="after")
    def _has_both_clocks(self) -> Confidence:
        if ("release_time" in self.derived) != ("camera_delay" in self.derived):
            raise refusal("derived: must have both release_time and camera_delay, or neither")
        return self


class ThetaFile(JsonRecord):
    band: str
    law: Law = "neo_hookean"
    theta: ThetaValues
    history: RecordedPull | None = None
    nuisances: Nuisances = Nuisances()
    turn_damping: Annotated[float, Range(*BOUNDS["turn_damping"])] = 0.0
    returned_share: Annotated[float, Range(*BOUNDS["returned_share"])] = 1.0
    mounted: bool = True
    loss: dict[Name, float] = {}
    rollouts: Count = 0
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
    """What a θ file's confidence rests on; no samples where it has none.

    `estimate`: The entries of the θ file that no table of evaluations holds.
    """

    names: list[str] = []
    samples: list[list[float]]
    estimate: dict = {}

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


def save_confidence(
    path: Path, band: str, entries: dict, samples: Parameters | None = None, *, mounting: bool
) -> None:
    """Write a `PosteriorFile`: entries of the θ file, and samples if the search has any.

    Args:
        mounting: False: the search left the clamps as `setup` says.
    """
    if not mounting:
        entries = entries | {"mounted": False}
    names, values = ([], []) if samples is None else ([*samples.names], samples.values.tolist())
    content = {"band": band, "names": names, "samples": values, "estimate": entries}
    write_json(path, content)


def load_confidence(path: Path) -> dict:
    """The entries of the θ file that a `PosteriorFile` holds. Raises NotMade."""
    return read_json(path, PosteriorFile).estimate


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


class Mounting(JsonRecord):
    """How a band leaves its clamps, and its flexural rigidity [N m^2]."""

    clamp_direction: Direction
    flexural_rigidity: Annotated[float, Range(0, 1e3)]


def load_sling(
    params: Settings,
    band: str,
    clamps: Path | None,
    law: str = NEO_HOOKEAN,
    *,
    mounted: bool = True,
) -> ClampedBand:
    """A band of params.yaml, mounted as its recording shows where that was fitted.

    Args:
        clamps: File of the mounting that was fitted; without one the band hangs as `setup` says.
        mounted: False leaves out what was fitted.

    Raises NotMade where the file of the mounting is damaged.
    """
    mounting = None
    if mounted and clamps is not None and clamps.exists():
        mounting = read_json(clamps, Mounting)
    return ClampedBand.of(params.bands[band], params.setup, params.sling, mounting, law=law)


def sling_of_method(params: Settings, band: str, method: str, clamps: Path | None) -> ClampedBand:
    """A band as a method of params.yaml takes it: with its law, mounted or not."""
    method_params = params.methods[method]
    return load_sling(params, band, clamps, method_params.law, mounted=method_params.mounting)


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


def law_entries(law: str, history: dict | None) -> dict:
    """What a θ file says of a law: its name, unless neo-Hookean; with memory, the pull."""
    named = {} if law == NEO_HOOKEAN else {"law": law}
    return named | ({"history": history} if law == RUBBER else {})


def content_of(parameters: Parameters, history: LaunchHistory | None = None) -> dict:
    """What a θ file says of one sample; the inverse of `parameters_of`.

    Args:
        history: Of the recording's hand, which a law with memory needs.
    """
    values, law = parameters.sample(), parameters.law
    return {
        **law_entries(law, history and vars(history)),
        "theta": {name: values[name] for name in parameter_names(law)},
        "nuisances": {"air_drag": values["air_drag"]},
        "turn_damping": values["turn_damping"],
        "returned_share": values["returned_share"],
    }
