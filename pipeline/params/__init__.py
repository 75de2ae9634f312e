"""Typed view of params.yaml: `load()` refuses unknown keys, wrong types and impossible values.

Attribute names are the keys of the file: the library's settings, and what the experiment adds.
Every violation is a UserError of one line that names the key's path.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from pipeline.params.run import FloorParams, RunParams, methods_by_step
from pipeline.params.virtual_rig import RigParams
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.schema import FILLED, Name, refusal
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import MethodParams
from sling2sim2real.settings.lab import BandName, BandParams


class Params(Settings):
    passed_over: ClassVar[tuple[str, ...]] = ()

    run: RunParams
    bands: Annotated[dict[BandName, BandParams], FILLED] = Field()
    methods: Annotated[dict[Name, MethodParams], FILLED] = Field()
    floor: FloorParams
    rig: RigParams

    @model_validator(mode="after")
    def _names_agree(self) -> Params:
        for key, names, defined in (
            ("bands", self.run.bands, self.bands),
            ("own", self.run.own, self.bands),
            ("dips", self.run.dips, self.bands),
            ("methods", self.run.methods, self.methods),
            ("ablations.methods", self.run.ablations.methods, self.methods),
        ):
            for name in names:
                if name not in defined:
                    raise refusal(f"run.{key}: {name} is not one of {', '.join(defined)}")
        for band in self.run.ablations.bands:
            if band not in self.run.bands:
                raise refusal(f"run.ablations.bands: {band} is not one of run.bands")
        for band in self.run.own:
            if self.bands[band].source == "rig":
                raise refusal(f"run.own: {band} has source: rig, so it belongs under run.bands")
        for band in self.run.dips:
            if self.bands[band].source == "recording":
                raise refusal(f"run.dips: {band} has source: recording: put it under run.own")
        first = self.run.methods[:1]
        for key, steps, whose, methods in (
            ("run.steps", self.run.steps, "run.methods", self.run.methods),
            ("run.own_steps", self.run.own_steps, "run.methods[0]", first),
            (
                "run.ablations.steps",
                self.run.ablations.steps,
                "run.ablations.methods",
                self.run.ablations.methods,
            ),
        ):
            for step, names in methods_by_step(methods, self.methods).items():
                if list(getattr(steps, step)) != names:
                    raise refusal(
                        f"{key}.{step}: must list those of {whose} whose search has this step:"
                        f" [{', '.join(names)}]"
                    )
        for key, run in (("run", self.run), ("run.ablations", self.run.ablations)):
            rig = [name for name in run.bands if self.bands[name].source == "rig"]
            if list(run.rig) != rig:
                raise refusal(
                    f"{key}.rig: must list those of {key}.bands that have source: rig, in the same"
                    f" order: [{', '.join(rig)}]"
                )
        for name in (*self.run.rig, *self.run.dips):
            if name not in self.rig.bands:
                raise refusal(f"rig.bands: lacks {name}, which the rig is to record")
        return self

    @model_validator(mode="after")
    def _likes_have_one_size(self) -> Params:
        for name, band in self.rig.bands.items():
            if band.like is None or not {name, band.like} <= self.bands.keys():
                continue
            for what in ("mass", "diameter", "rest_length"):
                if getattr(self.bands[name], what) != getattr(self.bands[band.like], what):
                    raise refusal(
                        f"bands.{name}.{what}: must be that of {band.like}, which"
                        f" rig.bands.{name} is like"
                    )
        return self


def load(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml. Raises UserError."""
    if not Path(path).exists():
        raise UserError(f"{path}: no such file; run this in the project's folder")
    return Params.load(path)
