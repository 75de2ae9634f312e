"""What params.yaml says of a lab: bands, set-up and recorded pull."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sling2sim2real.base.schema import (
    ASCENDING,
    FILLED,
    LIST,
    UNIT,
    Component,
    Direction,
    Metres,
    Pose,
    Range,
    Section,
    refusal,
)


def _lies_beside(name: str) -> str:
    if name != Path(name).name or name.startswith("."):
        raise refusal(f"must be the name of a file in robots/, got {name!r}")
    return name


FileName = Annotated[str, FILLED, AfterValidator(_lies_beside)]


class BandSizes(Section):
    """By scale, calliper and ruler [kg, m]; `preconditioned` as the simulator has it."""

    mass: Annotated[float, Range(1e-4, 1)]
    diameter: Annotated[float, Range(5e-4, 0.05)]
    rest_length: Annotated[float, Range(0.05, 3)]
    preconditioned: bool | Annotated[float, Range(0, 3)] = False


class BandParams(BandSizes):
    source: Literal["recording", "rig"]

    @property
    def density(self) -> float:
        """Mean over a solid cylinder of this size [kg/m^3]."""
        return self.mass / (math.pi / 4 * self.diameter**2 * self.rest_length)


class Topics(Section):
    wrench: str | None = None
    pose: str | None = None
    gripper: str | None = None
    color: str | None = None
    depth: str | None = None
    color_info: str | None = None
    depth_info: str | None = None


class Tool(Section):
    """What the force sensor carries: hand, fingers, flange."""

    mass: Annotated[float, Range(0, 20)]
    center: Annotated[tuple[Metres, Metres, Metres], LIST]


DrawY = Annotated[float, Range(-2, -0.05)]
DrawZ = Annotated[float, Range(-2, 1)]


class SetupParams(Section):
    fork_width: Annotated[float, Range(0.02, 2)] = 0.275
    foot_height: Annotated[float, Range(0, 1)] = 0.02
    fork_height: Annotated[float, Range(0.05, 3)] = 0.52
    clamp_direction: Direction = (0.0, 0.0, -1.0)
    projectile_mass: Annotated[float, Range(1e-3, 1)] = 0.039
    air_density: Annotated[float, Range(0, 100)] = 1.2
    grip_force: Annotated[float, Range(0.1, 500)] = 40.0
    finger_opening_time: Annotated[float, Range(1e-3, 1)] = 0.004
    max_force: Annotated[float, Range(0.1, 1000)] = 30.0
    arm_stiffness: Annotated[float, Range(300, 1e6)] | None = 12000.0
    draw_y: Annotated[tuple[DrawY, DrawY], LIST, ASCENDING] = (-0.45, -0.25)
    draw_z: Annotated[tuple[DrawZ, DrawZ], LIST, ASCENDING] = (-0.3, -0.1)
    base_to_fork: Pose | None = None
    camera_to_fork: Pose | None = None
    urdf: FileName | None = None
    tip_link: str | None = None
    tool: Tool | None = None
    topics: Topics = Field(default_factory=Topics)


Speed = Annotated[float, Range(0.005, 3)]
Way = Annotated[float, Range(0, 0.5)]
Opening = Annotated[float, Range(0, 0.5)]
Quaternion = Annotated[tuple[Component, Component, Component, Component], LIST, UNIT]


def _is_position(value: object) -> object:
    if value in ("finger", "gap"):
        return value
    pair = value if isinstance(value, list | tuple) else ()
    numbers = [n for n in pair if isinstance(n, int | float) and math.isfinite(n)]
    if len(pair) != 2 or len(numbers) != 2 or numbers[0] == numbers[1]:
        raise refusal(f"must be finger, gap, or its numbers [open, closed], got {value!r:.60}")
    return float(numbers[0]), float(numbers[1])


class Gripper(Section):
    """Gaps between the fingers, and what GripperCommand's `position` is for them.

    `position`: finger, the travel of each (Franka's own action server); gap; or the two numbers
    themselves, for open and for closed.
    """

    open: Opening = 0.08
    closed: Opening = 0.0
    position: Annotated[str | tuple[float, float], BeforeValidator(_is_position)] = "finger"

    def command(self, gap: float) -> float:
        """The position that commands a gap [m] between open and closed."""
        if isinstance(self.position, str):
            return gap / 2 if self.position == "finger" else gap
        first, last = self.position
        return last + (first - last) * (gap - self.closed) / (self.open - self.closed)

    @model_validator(mode="after")
    def _closed_is_narrower(self) -> Gripper:
        if self.closed >= self.open:
            raise refusal("closed must be less than open")
        return self


class Dip(Section):
    """The drawn band is let back by some way and drawn again, which shows how it unloads."""

    at: Annotated[float, Range(0.1, 1)]  # share of the draw where it begins and ends
    depth: Annotated[float, Range(0.01, 1)]  # way back towards the fork
    out_time: Annotated[float, Range(0.05, 20)]
    back_time: Annotated[float, Range(0.05, 20)]


def _dips() -> tuple[Dip, ...]:
    return (
        Dip(at=0.8, depth=0.21, out_time=1.05, back_time=1.05),
        Dip(at=1.0, depth=0.26, out_time=1.3, back_time=1.3),
        Dip(at=1.0, depth=0.23, out_time=1.15, back_time=1.15),
    )


class PlanParams(Section):
    """How a robot records a band: read by `sling plan`, and by the virtual rig for its dips."""

    draw: Annotated[tuple[DrawY, DrawZ], LIST] = (-0.4, 0.0)
    dips: tuple[Dip, ...] = Field(default_factory=_dips, strict=False)
    max_speed: Speed = 0.4
    pull_speed: Speed = 0.2
    max_acceleration: Annotated[float, Range(0.05, 30)] = 2.0
    lead_in: Annotated[float, Range(0.5, 60)] = 1.0
    finger_time: Annotated[float, Range(0.05, 10)] = 0.7
    pause: Annotated[float, Range(0.5, 60)] = 2.0  # the held force is the mean of the last 0.5 s
    wait: Annotated[float, Range(0, 60)] = 1.5
    approach: Way = 0.1
    retreat: Way = 0.06
    floor_clearance: Way = 0.1
    hanging: Annotated[float, Range(0, 3)] | None = None
    gripper: Gripper = Field(default_factory=Gripper)
    orientation: Quaternion | None = None
    frame: Annotated[str, FILLED] = "base"

    @model_validator(mode="after")
    def _pulls_slower(self) -> PlanParams:
        if self.pull_speed > self.max_speed:
            raise refusal("pull_speed must be at most max_speed")
        return self
