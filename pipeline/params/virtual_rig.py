"""What params.yaml says of the hidden world that the virtual rig records."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import model_validator

from pipeline.base.schema import LIST, Metres, Name, Pose, Range, Section, Seed, refusal

Share = Annotated[float, Range(0, 1)]
Point = Annotated[tuple[Metres, Metres, Metres], LIST]
Relaxation = Annotated[  # weight and time
    tuple[Annotated[float, Range(0, 10)], Annotated[float, Range(1e-4, 1e4)]], LIST
]


class RigBand(Section):
    peak_force: Annotated[float, Range(0.1, 1000)]
    relaxation: Annotated[tuple[Relaxation, ...], LIST]
    viscosity: Annotated[float, Range(1e-4, 0.1)]
    color: Annotated[tuple[Share, Share, Share], LIST]


class RigWrench(Section):
    yaw: Annotated[float, Range(-math.pi, math.pi)]  # of the sensor against the hand
    tool_mass: Annotated[float, Range(0, 10)]
    noise: Annotated[float, Range(0, 10)]
    torque_noise: Annotated[float, Range(0, 1)]
    bias: Annotated[float, Range(0, 100)]
    drift: Annotated[float, Range(0, 10)]  # over the recording


class RigPads(Section):
    """Of the fingers, as they truly are; `setup:` has what the lab takes them for."""

    friction: Annotated[float, Range(0.05, 10)]
    force: Annotated[float, Range(0.1, 1000)]
    opening_time: Annotated[float, Range(1e-4, 0.1)]
    shape: Annotated[float, Range(0.2, 5)]


class RigArm(Section):
    mass: Annotated[float, Range(0.1, 100)]
    stiffness: Annotated[float, Range(100, 1e6)]
    damping_ratio: Annotated[float, Range(0.05, 5)]


class RigClock(Section):
    """Of one source's messages; the delay is from the stamp to the receipt."""

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
    bands: dict[Name, RigBand]

    @model_validator(mode="after")
    def _middle_is_a_node(self) -> RigParams:
        if self.edges % 2:
            raise refusal("edges must be even: the hand holds the middle node")
        return self
