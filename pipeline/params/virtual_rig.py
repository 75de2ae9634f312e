"""What params.yaml says of the hidden world that the virtual rig records."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import model_validator

from sling2sim2real.base.schema import (
    ASCENDING,
    LIST,
    Metres,
    Name,
    Pose,
    Range,
    Section,
    Seed,
    refusal,
)

Share = Annotated[float, Range(0, 1)]
Value = Annotated[float, Range(-1e6, 1e6)]
Point = Annotated[tuple[Metres, Metres, Metres], LIST]
Time = Annotated[float, Range(1e-4, 1e4)]
Pull = Literal["paper", "informative"]
Relaxation = Annotated[tuple[Annotated[float, Range(0, 10)], Time], LIST]  # weight and time


LAWS = {  # ranges of each law's constants; rig/physics/elasticity.py says what they are
    "gent": ((15, 1e4),),
    "arruda_boyce": ((6, 1e4),),
    "extended_tube": ((1e-3, 0.25), (0.01, 1), (0, 100)),
    "carroll": ((0, 10), (0, 1e-2), (0, 10)),
    "lopez_pamies": ((0, 10), (0.1, 10), (0, 10), (0.1, 10)),
}


class RigSpectrum(Section):
    """Relaxation in so many branches, weights as time^-slope: 0 is flat, more is steep."""

    weight: Annotated[float, Range(0, 10)]
    times: Annotated[tuple[Time, Time], LIST, ASCENDING]
    branches: Annotated[int, Range(1, 40)]
    slope: Annotated[float, Range(-2, 2)]


class RigFlow(Section):
    """A second network that flows."""

    share: Annotated[float, Range(0, 10)]
    rate: Annotated[float, Range(0, 1e9)]
    power: Annotated[float, Range(1, 10)]
    chain: Annotated[float, Range(-1, 0)]
    offset: Annotated[float, Range(1e-3, 1)]


class RigSoftening(Section):
    """Softening by the largest energy so far; `energy` is over Young's modulus, or a strain."""

    form: Literal["energy", "strain"] = "energy"
    damage: Annotated[float, Range(1, 100)]
    energy: Annotated[float, Range(1e-3, 100)]
    growth: Annotated[float, Range(0, 10)]


class RigBand(Section):
    """What a band is made of."""

    peak_force: Annotated[float, Range(0.1, 1000)]
    relaxation: Annotated[tuple[Relaxation, ...], LIST]
    viscosity: Annotated[float, Range(1e-4, 0.1)]
    color: Annotated[tuple[Share, Share, Share], LIST]
    law: Literal["ogden", "gent", "arruda_boyce", "extended_tube", "carroll", "lopez_pamies"]
    constants: Annotated[tuple[Annotated[float, Range(-100, 1e4)], ...], LIST]
    spectrum: RigSpectrum | None
    flow: RigFlow | None
    softening: RigSoftening | None

    @model_validator(mode="after")
    def _the_law_has_its_constants(self) -> RigBand:
        given = self.constants
        if self.law == "ogden":
            pairs = [factor * other for factor, other in zip(given[::2], given[1::2], strict=False)]
            if len(given) % 2 or not all(product > 0 for product in pairs):
                raise refusal("constants: ogden has pairs of modulus and exponent of one sign")
            return self
        limits = LAWS[self.law]
        inside = (
            low <= constant <= high for constant, (low, high) in zip(given, limits, strict=False)
        )
        if given and not (len(given) == len(limits) and all(inside)):
            ranges = ", ".join(f"{low:g} to {high:g}" for low, high in limits)
            raise refusal(f"constants: {self.law} has [{ranges}], got {list(given)}")
        return self


class RigRecording(Section):
    """How a recording is made."""

    pull: Pull


class RigWrench(Section):
    yaw: Annotated[float, Range(-math.pi, math.pi)]  # of the sensor against the hand
    tool_mass: Annotated[float, Range(0, 10)]
    noise: Annotated[float, Range(0, 10)]
    torque_noise: Annotated[float, Range(0, 1)]
    bias: Annotated[float, Range(0, 100)]
    drift: Annotated[float, Range(0, 10)]  # over the recording


class RigPads(Section):
    """Pads of the fingers, as they truly are; `setup:` has what the lab takes them for."""

    friction: Annotated[float, Range(0.05, 10)]
    force: Annotated[float, Range(0.1, 1000)]
    opening_time: Annotated[float, Range(1e-4, 0.1)]
    shape: Annotated[float, Range(0.2, 5)]


class RigArm(Section):
    mass: Annotated[float, Range(0.1, 100)]
    stiffness: Annotated[float, Range(100, 1e6)]
    damping_ratio: Annotated[float, Range(0.05, 5)]


class RigClock(Section):
    """Clock of one source's messages; the delay is from the stamp to the receipt."""

    stamp_jitter: Annotated[float, Range(0, 0.01)]
    delay: Annotated[float, Range(0, 1)]
    delay_jitter: Annotated[float, Range(0, 1)]


class RigCamera(Section):
    position: Point
    target: Point
    focal: Annotated[float, Range(50, 5000)]
    range: Annotated[float, Range(0.1, 100)]
    exposure: Annotated[float, Range(0, 0.02)]
    clock: RigClock
    drop_rate: Share
    color_noise: Annotated[float, Range(0, 100)]
    depth_noise: Annotated[float, Range(0, 0.1)]
    dropout: Share
    edge_loss: Share
    edge_fly: Share
    translation_error: Annotated[float, Range(0, 0.1)]
    rotation_error: Annotated[float, Range(0, 0.1)]


class RigParams(Section):
    seed: Seed
    edges: Annotated[int, Range(4, 1000)]
    tolerance: Annotated[float, Range(1e-10, 1e-3)]
    pads: RigPads
    tracking_error: Annotated[float, Range(0, 0.01)]
    pose_latency: Annotated[float, Range(0, 0.1)]
    release_jitter: Annotated[float, Range(0, 1)]
    projectile_drag: Annotated[float, Range(0, 0.01)]
    base: Pose
    tool_pitch: Annotated[float, Range(-1.5, 1.5)]
    arm: RigArm
    clock: RigClock
    wrench: RigWrench
    camera: RigCamera
    draws: dict[str, Annotated[tuple[Value, Value], LIST, ASCENDING]]
    launch_draws: dict[str, Annotated[tuple[Value, Value], LIST, ASCENDING]]
    recordings: dict[Name, RigRecording]
    bands: dict[Name, RigBand | None]  # None: a lab recorded it

    @model_validator(mode="after")
    def _draws_are_of_keys(self) -> RigParams:
        for key in (*self.draws, *self.launch_draws):
            value: object = self
            for name in key.split("."):
                value = getattr(value, name, None)
            if not isinstance(value, float):
                raise refusal(f"draws: {key} is no number of the rig")
        return self

    @model_validator(mode="after")
    def _middle_is_a_node(self) -> RigParams:
        if self.edges % 2:
            raise refusal("edges must be even: the hand holds the middle node")
        return self
