"""Typed view of params.yaml: `load()` refuses unknown keys, wrong types and impossible values.

Attribute names are the keys of the file: the library's settings, and what the experiment adds.
Every violation is a UserError of one line that names the key's path.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from pipeline.params.run import UNIONS, FloorParams, RunParams
from pipeline.params.virtual_rig import RigParams
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.schema import FILLED, Name, refusal
from sling2sim2real.settings import Settings
from sling2sim2real.settings.identification import OWN, SEARCHES, MethodParams
from sling2sim2real.settings.lab import BandParams


class Params(Settings):
    passed_over: ClassVar[tuple[str, ...]] = ()

    run: RunParams
    bands: Annotated[dict[Name, BandParams], FILLED] = Field()
    methods: Annotated[dict[Name, MethodParams], FILLED] = Field()
    floor: FloorParams
    rig: RigParams

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
        for band in run.floors:
            if band not in self.bands or self.bands[band].source != "rig":
                raise refusal(f"run.floors: {band} is no band of the rig")
        return self

    @model_validator(mode="after")
    def _the_rig_knows_its_bands(self) -> Params:
        """DVC wants the key of a lab's band too, whose launches the rig does not make."""
        for band, sizes in self.bands.items():
            if band not in self.rig.bands:
                raise refusal(f"rig.bands: lacks {band}; of a band that a lab recorded it is empty")
            if (self.rig.bands[band] is not None) != (sizes.source == "rig"):
                raise refusal(f"rig.bands.{band}: does not fit to bands.{band}.source")
        for recording in self.run.rig.values():
            if recording.recording not in self.rig.recordings:
                raise refusal(f"rig.recordings: lacks {recording.recording}")
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


def load(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml. Raises UserError."""
    if not Path(path).exists():
        raise UserError(f"{path}: no such file; run this in the project's folder")
    return Params.load(path)
