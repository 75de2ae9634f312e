"""Identify each recording of a band alone, and put them in order in time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from app.command_line import say
from app.drift.change import ValueOfRecording
from pipeline.base.fingerprint import fingerprint
from pipeline.base.layout import NotMade
from pipeline.base.schema import JsonRecord, read_json
from pipeline.episode.pull import deepest_draw
from pipeline.recording.input.bag import sha256
from sling2sim2real.episodes import read_mcap
from sling2sim2real.identification import Identification, identify
from sling2sim2real.model import Band
from sling2sim2real.settings import Settings

COMPARED = "youngs_modulus", "damping_product"  # what a taut band feels of theta
USED = "setup", "episode", "force", "cloud", "sling", "parameters", "loss", "optimizer", "methods"
CLOCK_SET = datetime(2000, 1, 1, tzinfo=UTC).timestamp() * 1e9  # a simulation counts from 0


class IdentifiedRecording(JsonRecord):
    """What a recording says by itself.

    Attributes:
        file: Its name.
        key: Of all that the values depend on.
        begin, end: Of its pulls' windows, by its own stamps [ns].
        pulls: That could be used.
        settled: Whether the fit has converged.
        deepest: How far it draws the band [m].
        values: Of COMPARED, by name.
    """

    file: str
    key: str
    begin: int
    end: int
    pulls: int
    settled: bool
    deepest: float
    values: dict[str, ValueOfRecording]

    @property
    def date(self) -> str:
        when = datetime.fromtimestamp(self.begin / 1e9, UTC)
        return f"{when:%Y-%m-%d %H:%M} UTC"


class KeptRecordings(JsonRecord):
    """Recordings of a drift.json, which the next one may take over."""

    recordings: list[IdentifiedRecording]


def identified(
    files: Sequence[Path], band: Band, settings: Settings, code: dict[str, str], retained: Path
) -> list[IdentifiedRecording]:
    """Identify each file alone, by its own mounting, exploration and nuisances.

    Args:
        code: Digests of the code that does it.
        retained: JSON of an earlier call, from which what is the same is taken.

    Raises:
        UserError: A recording cannot be used.
    """
    try:
        earlier = {
            recording.key: recording for recording in read_json(retained, KeptRecordings).recordings
        }
    except NotMade:
        earlier = {}
    inputs = json.dumps([vars(band), settings.model_dump(mode="json", include=set(USED)), code])
    result = []
    for file in files:
        key = fingerprint(inputs, sha256(file))
        if not (recording := earlier.get(key)):
            say(f"{file}: identifying it alone ...")
            recording = _alone(file, key, band, settings)
        result.append(recording.model_copy(update={"file": file.name}))
    return result


def _alone(file: Path, key: str, band: Band, settings: Settings) -> IdentifiedRecording:
    episodes = read_mcap(file, band, settings=settings)
    begins = [episode.metadata["input"]["start_ns"] for episode in episodes]
    identification = identify(episodes, band, settings=settings)
    return IdentifiedRecording(
        file=file.name,
        key=key,
        begin=begins[0],
        end=begins[-1] + int(1e9 * episodes[-1].sample_period * len(episodes[-1].time)),
        pulls=len(episodes),
        settled=identification.settled,
        deepest=deepest_draw(episodes),
        values=values_of(identification),
    )


def values_of(identification: Identification) -> dict[str, ValueOfRecording]:
    """Values of the quantities COMPARED, by name."""
    assert identification.samples is not None  # a fit draws them
    columns = dict(zip(identification.theta.names, identification.samples.T, strict=True))
    columns["damping_product"] = columns["elasticity_damping"] * columns["damping_scale"]
    return {
        name: ValueOfRecording(
            value=identification.intervals[name].value,
            low=identification.intervals[name].low,
            high=identification.intervals[name].high,
            deviation=float(np.log(columns[name]).std()),
        )
        for name in COMPARED
    }


def in_time(recordings: Sequence[IdentifiedRecording]) -> list[IdentifiedRecording] | None:
    """Order recordings by their stamps; None where those are no wall clock's.

    A simulation's clock begins at 0, or each time anew: then recordings are of the same time.
    """
    ordered = sorted(recordings, key=lambda recording: recording.begin)
    apart = all(
        recording.end <= after.begin for recording, after in zip(ordered, ordered[1:], strict=False)
    )
    return ordered if apart and ordered[0].begin > CLOCK_SET else None
