"""What a θ file says under `confidence`, as the density (identify/posterior) writes it.

As much of it as is read: a file edited by hand is refused in one line, not where it is used.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from sling2sim2real.base.schema import FILLED, LIST, JsonRecord, Name, refusal

Count = Annotated[int, Field(ge=0)]
Unit = Annotated[str, Field(pattern=r"^[A-Za-z0-9/%]{0,12}$")]


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


class WithoutRecording(JsonRecord):
    """What all other evidence says: by how many standard deviations coordinates move."""

    misfit: float
    moved: Annotated[dict[Name, float], FILLED]


class RecordingResiduals(JsonRecord):
    """Root mean squares [N, m, m]; seconds after the release of the pictures of the recoil."""

    force_rms: float
    held_rms: float
    recoil_rms: float
    pictures: list[float]
    source: EpisodeSource = EpisodeSource()
    without_it: WithoutRecording | None = None


class LaunchResidual(JsonRecord):
    draw: Annotated[tuple[float, float], LIST]
    landing: float
    left: float | None


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
