"""Typed view of params.yaml: `load()` refuses unknown keys, wrong types and impossible values.

Attribute names are the keys of the file. Ranges say what makes physical or numerical sense, wide
enough for any lab. Every violation is a UserError of one line that names the key's path.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import ValidationError, model_validator
from ruamel.yaml import YAML, YAMLError

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.schema import FILLED, Name, Section, explained, refusal
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.settings.identification import (
    OWN,
    SEARCHES,
    LossParams,
    MethodDefaults,
    MethodParams,
    OptimizerParams,
    ParameterBoxes,
    SlingParams,
    check_method,
)
from sling2sim2real.settings.lab import BandParams, PlanParams, SetupParams
from sling2sim2real.settings.launches import FloorParams, LaunchParams, PolicyParams, TrialsParams
from sling2sim2real.settings.recording import CloudParams, EpisodeParams, ForceParams
from sling2sim2real.settings.run import UNIONS, RunParams
from sling2sim2real.settings.virtual_rig import RigParams


class Params(Section):
    run: RunParams
    bands: Annotated[dict[Name, BandParams], FILLED]
    setup: SetupParams
    plan: PlanParams
    episode: EpisodeParams
    force: ForceParams
    cloud: CloudParams
    sling: SlingParams
    parameters: ParameterBoxes
    loss: LossParams
    optimizer: OptimizerParams
    method_defaults: MethodDefaults
    methods: Annotated[dict[Name, MethodParams], FILLED]
    policy: PolicyParams
    launch: LaunchParams
    trials: TrialsParams
    floor: FloorParams
    rig: RigParams

    @model_validator(mode="before")
    @classmethod
    def _methods_are_whole(cls, content: object) -> object:
        """A method's own keys win; what it leaves out is as `method_defaults` says."""
        if not isinstance(content, dict):
            return content
        defaults, methods = content.get("method_defaults"), content.get("methods")
        if not (isinstance(defaults, dict) and isinstance(methods, dict)):
            return content
        whole = {
            name: {**defaults, **method} if isinstance(method, dict) else method
            for name, method in methods.items()
        }
        return content | {"methods": whole}

    @model_validator(mode="after")
    def _names_agree(self) -> Params:
        run = self.run
        for key, names, defined in (
            ("run.recordings", [entry.band for entry in run.recordings.values()], self.bands),
            ("run.pairs", [pair.method for pair in run.pairs.values()], self.methods),
        ):
            for name in names:
                if name not in defined:
                    raise refusal(f"{key}: {name} is not one of {', '.join(defined)}")
        for key, recording in run.recordings.items():
            if (self.bands[recording.band].source == "rig") != (key in run.rig):
                where = "recordings alone" if key in run.rig else "rig"
                source = self.bands[recording.band].source
                raise refusal(f"run.{where}: wants {key}, whose band has source: {source}")
        for recording in run.rig.values():
            for name, defined in (("bands", self.rig.bands), ("recordings", self.rig.recordings)):
                wanted = recording.band if name == "bands" else recording.recording
                if wanted not in defined:
                    raise refusal(f"rig.{name}: lacks {wanted}, which the rig is to record")
        for band in run.floors:
            if band not in self.rig.bands or band not in self.bands:
                raise refusal(f"run.floors: {band} is no band of the rig")
        return self

    @model_validator(mode="after")
    def _pairs_go_through_the_steps_of_their_search(self) -> Params:
        for kind in UNIONS["pairs"]:
            for key, pair in getattr(self.run, kind).items():
                search = self.methods[pair.method].search
                wanted = search if search in UNIONS["explored"] else "search"
                if kind != wanted:
                    raise refusal(
                        f"run.{kind}: {key} belongs under run.{wanted}, for methods.{pair.method}"
                        f" has search: {search}"
                    )
                code = (search if search in SEARCHES else OWN) if kind == "search" else None
                if pair.search != code:
                    raise refusal(
                        f"run.{kind}.{key}.search: must be {code or 'left out'}: whose code it runs"
                    )
        return self

    @model_validator(mode="after")
    def _sections_fit(self) -> Params:
        for name, method in self.methods.items():
            check_method(method, f"methods.{name}.", self.parameters, self.optimizer)
        if self.setup.foot_height >= self.setup.fork_height:
            raise refusal("setup.foot_height: must be less than setup.fork_height")
        if self.setup.draw_z[0] <= -self.setup.fork_height:
            raise refusal("setup.draw_z: must be above the floor, setup.fork_height below the tips")
        for name, band in self.bands.items():
            if band.rest_length <= self.setup.fork_width:
                raise refusal(
                    f"bands.{name}.rest_length: {band.rest_length:g} must be longer than"
                    f" setup.fork_width, {self.setup.fork_width:g}"
                )
        return self

    @model_validator(mode="after")
    def _trials_are_trained(self) -> Params:
        low, high = self.policy.targets
        for target in self.trials.targets:
            if not low <= target <= high:
                raise refusal(
                    f"trials.targets: {target} lies outside policy.targets [{low}, {high}]"
                )
            if not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
                raise refusal(
                    f"trials.targets: {target} lies outside the target on the floor,"
                    f" {list(TARGET_AREA)}, where every landing counts as failed"
                )
        return self


def expect_known(params: Params, kind: str, name: str, called: str | None = None) -> None:
    """Raises UserError where there is no such `kind`, band or method; `called` names it."""
    defined = getattr(params, f"{kind}s")
    if name not in defined:
        raise UserError(
            f"{called or kind} {name}: not in params.yaml, which has {', '.join(defined)}"
        )


def load(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml. Raises UserError."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise UserError(f"{path}: no such file; run this in the project's folder") from error
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not UTF-8 text"
        raise UserError(f"{path}: cannot be read ({reason})") from error
    return parse(text, str(path))


def parse(text: str, name: str = "params.yaml") -> Params:
    """Check the text of a params.yaml; `name` stands in error messages. Raises UserError."""
    try:
        content = YAML(typ="safe").load(text)  # the parser that DVC uses
    except (YAMLError, ValueError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        what = getattr(error, "problem", None) or str(error).partition("\n")[0]
        raise UserError(f"{name}{where}: not valid YAML ({what})") from error
    return check(content, name)


def check(content: object, name: str = "params.yaml") -> Params:
    """Check what a params.yaml holds; `name` stands in error messages. Raises UserError."""
    if not isinstance(content, dict):
        raise UserError(f"{name}: must hold a mapping of sections such as `run:` and `bands:`")
    try:
        return Params.model_validate(content)
    except ValidationError as error:
        raise UserError(f"{name}: {explained(error, Params)}") from error
