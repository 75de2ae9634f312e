"""What params.yaml says of the way from a recording to an episode."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sling2sim2real.base.schema import Range, Section, refusal

Delay = Annotated[float, Range(-4e9, 4e9)]  # s: clocks may be of other epochs


class DelayParams(Section):
    pose: Delay | None = None
    camera: Delay | None = None


class EpisodeParams(Section):
    samples: Annotated[int, Range(30, 10_000)] = 300
    duration: Annotated[float, Range(1, 120)] = 9.0
    longest: Annotated[float, Range(1, 120)] = 20.0
    tail: Annotated[float, Range(0.1, 60)] = 0.7
    delays: DelayParams = Field(default_factory=DelayParams)

    @model_validator(mode="after")
    def _within(self) -> EpisodeParams:
        if self.tail >= self.duration:
            raise refusal("tail must be less than duration")
        if self.longest < self.duration:
            raise refusal("longest must be at least duration")
        return self


class ForceParams(Section):
    cutoff: Annotated[float, Range(1e-4, 1e4)] = 0.224
    cutoff_unit: Literal["rad/sample", "rad/s", "Hz"] = "rad/sample"

    @model_validator(mode="after")
    def _below_nyquist(self) -> ForceParams:
        if self.cutoff_unit == "rad/sample" and self.cutoff >= math.pi:
            raise refusal("cutoff must be below pi rad/sample")
        return self


class CloudParams(Section):
    points: Annotated[int, Range(10, 100_000)] = 1000
    mask: Literal["opencv", "folder"] = "opencv"
    statistical_neighbors: Annotated[int, Range(1, 1000)] = 20
    statistical_ratio: Annotated[float, Range(0.1, 100)] = 2.0
    radius: Annotated[float, Range(1e-4, 1)] = 0.01
    radius_neighbors: Annotated[int, Range(1, 1000)] = 5
    sampling: Literal["after_filters", "before_filters"] = "after_filters"
