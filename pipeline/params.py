"""Typed view of params.yaml: `load()` refuses unknown keys, wrong types and impossible values.

Attribute names are the keys of the file. Ranges say what makes physical or numerical sense, wide
enough for any lab. Every violation is a UserError of one line that names the key's path.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Generic, Literal, TypeVar

from pydantic import AfterValidator, ValidationError, model_validator
from ruamel.yaml import YAML, YAMLError

from pipeline.errors import UserError
from pipeline.schema import (
    ASCENDING,
    FILLED,
    LIST,
    UNIQUE,
    UNIT,
    Component,
    Direction,
    Metres,
    Name,
    Names,
    Pattern,
    Pose,
    Range,
    Section,
    Seed,
    one_line,
    refusal,
)

Distance = Annotated[float, Range(0.1, 20)]  # along the floor, m
Step = Annotated[float, Range(1e-5, 0.05)]
Bound = TypeVar("Bound")
# y of the paper's fixed target of 1 m by 1 m: a landing outside is a failure, so trials aim inside.
TARGET_AREA = (1.425, 2.425)


def _lies_beside(name: str) -> str:
    if name != Path(name).name or name.startswith("."):
        raise refusal(f"must be the name of a file in robots/, got {name!r}")
    return name


FileName = Annotated[str, FILLED, AfterValidator(_lies_beside)]


def _is_free(name: str) -> str:
    if name.lower() == "measured":
        raise refusal("data/trials/measured holds measured landings, choose another name")
    return name


BandName = Annotated[Name, AfterValidator(_is_free)]


class Run(Section):
    bands: Annotated[Names, FILLED]
    rig: Names
    methods: Annotated[Names, FILLED]


class Band(Section):
    source: Literal["recording", "rig"]
    mass: Annotated[float, Range(1e-4, 1)]
    diameter: Annotated[float, Range(5e-4, 0.05)]
    rest_length: Annotated[float, Range(0.05, 3)]


class Topics(Section):
    wrench: str | None
    pose: str | None
    twist: str | None
    gripper: str | None
    color: str | None
    depth: str | None
    color_info: str | None
    depth_info: str | None


class Tool(Section):
    """What the force sensor carries: hand, fingers, flange."""

    mass: Annotated[float, Range(0, 20)]
    center: Annotated[tuple[Metres, Metres, Metres], LIST]


DrawY = Annotated[float, Range(-2, -0.05)]
DrawZ = Annotated[float, Range(-2, 1)]


class Setup(Section):
    fork_width: Annotated[float, Range(0.02, 2)]
    fork_height: Annotated[float, Range(0.05, 3)]
    clamp_direction: Direction
    projectile_mass: Annotated[float, Range(1e-3, 1)]
    grip_force: Annotated[float, Range(0.1, 500)]
    finger_opening_time: Annotated[float, Range(1e-3, 1)]
    max_force: Annotated[float, Range(0.1, 1000)]
    draw_y: Annotated[tuple[DrawY, DrawY], LIST, ASCENDING]
    draw_z: Annotated[tuple[DrawZ, DrawZ], LIST, ASCENDING]
    base_to_fork: Pose | None
    camera_to_fork: Pose | None
    urdf: FileName | None
    tip_link: str | None
    start_pose: Pose | None
    tool: Tool | None
    topics: Topics


Delay = Annotated[float, Range(-0.5, 0.5)]


class Delays(Section):
    pose: Delay | None
    camera: Delay | None


class Episode(Section):
    samples: Annotated[int, Range(30, 10_000)]
    duration: Annotated[float, Range(1, 120)]
    tail: Annotated[float, Range(0.1, 60)]
    delays: Delays

    @model_validator(mode="after")
    def _tail_within(self) -> Episode:
        if self.tail >= self.duration:
            raise refusal("tail must be less than duration")
        return self


Speed = Annotated[float, Range(0.005, 3)]
Way = Annotated[float, Range(0, 0.5)]
Opening = Annotated[float, Range(0, 0.5)]
Quaternion = Annotated[tuple[Component, Component, Component, Component], LIST, UNIT]


class Gripper(Section):
    open: Opening
    closed: Opening

    @model_validator(mode="after")
    def _closed_is_narrower(self) -> Gripper:
        if self.closed >= self.open:
            raise refusal("closed must be less than open")
        return self


class Plan(Section):
    """What it asks of the episode is checked by `sling plan`, which alone reads it."""

    draw: Annotated[tuple[DrawY, DrawZ], LIST]
    max_speed: Speed
    pull_speed: Speed
    max_acceleration: Annotated[float, Range(0.05, 30)]
    lead_in: Annotated[float, Range(0.5, 60)]
    finger_time: Annotated[float, Range(0.05, 10)]
    pause: Annotated[float, Range(0.5, 60)]  # the held force is the mean of the last 0.5 s
    wait: Annotated[float, Range(0, 60)]
    approach: Way
    retreat: Way
    floor_clearance: Way
    hanging: Annotated[float, Range(0, 3)] | None
    gripper: Gripper
    orientation: Quaternion | None
    frame: Annotated[str, FILLED]

    @model_validator(mode="after")
    def _pulls_slower(self) -> Plan:
        if self.pull_speed > self.max_speed:
            raise refusal("pull_speed must be at most max_speed")
        return self


class Force(Section):
    cutoff: Annotated[float, Range(1e-4, 1e4)]
    cutoff_unit: Literal["rad/sample", "rad/s", "Hz"]

    @model_validator(mode="after")
    def _below_nyquist(self) -> Force:
        if self.cutoff_unit == "rad/sample" and self.cutoff >= math.pi:
            raise refusal("cutoff must be below pi rad/sample")
        return self


class Sam3(Section):
    weights: Annotated[str, FILLED]
    prompt: Annotated[str, FILLED]
    device: Annotated[str, Pattern("cuda(:[0-9]+)?|cpu")]


class Cloud(Section):
    points: Annotated[int, Range(10, 100_000)]
    mask: Literal["opencv", "sam3"]
    sam3: Sam3
    statistical_neighbors: Annotated[int, Range(1, 1000)]
    statistical_ratio: Annotated[float, Range(0.1, 100)]
    radius: Annotated[float, Range(1e-4, 1)]
    radius_neighbors: Annotated[int, Range(1, 1000)]


class Sling(Section):
    mesh: Literal["rod", "tetrahedra"]
    edges: Annotated[int, Range(4, 400)]
    grading: Annotated[float, Range(1, 20)]
    tet_edges: Annotated[int, Range(4, 400)]
    grip_step: Step
    recoil_step: Step
    recoil_time: Annotated[float, Range(1e-3, 10)]
    swing_step: Step
    launch_step: Step
    launch_time: Annotated[float, Range(0.01, 10)]

    @model_validator(mode="after")
    def _middle_is_a_layer(self) -> Sling:
        for name in ("edges", "tet_edges"):
            if getattr(self, name) % 2:
                raise refusal(f"{name} must be even: the hand holds the middle")
        return self


class Box(Section, Generic[Bound]):
    """One axis of the search; `Bound` says how far the box may reach."""

    low: Bound
    high: Bound
    scale: Literal["log", "linear"]

    @model_validator(mode="after")
    def _low_below_high(self) -> Box:
        if not self.low < self.high:
            raise refusal("low must be less than high")
        if self.scale == "log" and self.low <= 0:
            raise refusal("low must be above 0 on a log scale")
        return self


class Parameters(Section):
    youngs_modulus: Box[Annotated[float, Range(1e3, 1e9)]]
    poissons_ratio: Box[Annotated[float, Range(0, 0.495)]]
    elasticity_damping: Box[Annotated[float, Range(1e-6, 1)]]
    dynamic_friction: Box[Annotated[float, Range(0, 5)]]
    damping_scale: Box[Annotated[float, Range(0, 1)]]


class Loss(Section):
    chamfer: Literal["symmetric", "measured"]
    median_window: Annotated[int, Range(1, 101)]

    @model_validator(mode="after")
    def _window_has_a_middle(self) -> Loss:
        if self.median_window % 2 == 0:
            raise refusal("median_window must be odd")
        return self


Factor = Annotated[float, Range(0, 2)]


class Optimizer(Section):
    seed: Seed
    population: Annotated[int, Range(5, 100_000)]
    generations: Annotated[int, Range(1, 100_000)]
    mutation: Annotated[tuple[Factor, Factor], LIST, ASCENDING]
    recombination: Annotated[float, Range(0, 1)]
    k_top: Annotated[int, Range(1, 50)]
    k_nn: Annotated[int, Range(6, 10_000)]  # a covariance of five parameters needs six points
    delta: Annotated[float, Range(1e-3, 2)]
    cma_population: Annotated[int, Range(4, 10_000)]
    cma_rollouts: Annotated[int, Range(4, 10_000_000)]

    @model_validator(mode="after")
    def _budgets_suffice(self) -> Optimizer:
        history = self.population * (self.generations + 1)
        if self.k_nn > history:
            raise refusal(f"k_nn must be at most population x (generations + 1) = {history}")
        iteration = self.k_top * self.cma_population
        if self.cma_rollouts < iteration:
            raise refusal(f"cma_rollouts must be at least k_top x cma_population = {iteration}")
        return self


Weight = Annotated[float, Range(0, 1e6)]


class Weights(Section):
    geom: Weight
    force: Weight
    work: Weight
    taut: Weight

    @model_validator(mode="after")
    def _something_counts(self) -> Weights:
        if not any((self.geom, self.force, self.work, self.taut)):
            raise refusal("at least one weight must be above 0")
        return self


class Method(Section):
    weights: Weights


class Reward(Section):
    height: Annotated[float, Range(1e-3, 1e3)]
    scale: Annotated[float, Range(1e-3, 10)]
    penalty: Annotated[float, Range(0, 1e3)]


Nodes = Annotated[int, Range(4, 1000)]  # a cubic spline needs four
Width = Annotated[int, Range(1, 4096)]


class Policy(Section):
    seed: Seed
    targets: Annotated[tuple[Distance, Distance], LIST, ASCENDING]
    map_size: Annotated[tuple[Nodes, Nodes], LIST]
    envs: Annotated[int, Range(2, 1_000_000)]
    steps: Annotated[int, Range(2, 10_000)]  # with 2 envs: one sample a mini-batch
    iterations: Annotated[int, Range(1, 100_000)]
    hidden: Annotated[tuple[Width, ...], LIST, FILLED]
    learning_rate: Annotated[float, Range(1e-7, 1)]
    init_std: Annotated[float, Range(1e-3, 10)]
    final_std: Annotated[float, Range(1e-4, 10)]
    reward: Reward


class Trials(Section):
    seed: Seed
    targets: Annotated[tuple[Distance, ...], LIST, FILLED, UNIQUE]
    repeats: Annotated[int, Range(1, 10_000)]
    actuation_error: Annotated[float, Range(0, 0.1)]


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


class Rig(Section):
    seed: Seed
    edges: Annotated[int, Range(4, 1000)]
    tolerance: Annotated[float, Range(1e-10, 1e-3)]
    pad_friction: Annotated[float, Range(0.05, 10)]
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
    def _middle_is_a_node(self) -> Rig:
        if self.edges % 2:
            raise refusal("edges must be even: the hand holds the middle node")
        return self


class Params(Section):
    run: Run
    bands: Annotated[dict[BandName, Band], FILLED]
    setup: Setup
    plan: Plan
    episode: Episode
    force: Force
    cloud: Cloud
    sling: Sling
    parameters: Parameters
    loss: Loss
    optimizer: Optimizer
    methods: Annotated[dict[Name, Method], FILLED]
    policy: Policy
    trials: Trials
    rig: Rig

    @model_validator(mode="after")
    def _names_agree(self) -> Params:
        for section, names in (("bands", self.run.bands), ("methods", self.run.methods)):
            known = getattr(self, section)
            for name in names:
                if name not in known:
                    raise refusal(f"run.{section}: {name} is not one of {', '.join(known)}")
        rig = [name for name in self.run.bands if self.bands[name].source == "rig"]
        if list(self.run.rig) != rig:
            raise refusal(
                "run.rig: must list those of run.bands that have source: rig, in the same order:"
                f" [{', '.join(rig)}]"
            )
        for name in rig:
            if name not in self.rig.bands:
                raise refusal(f"rig.bands: lacks {name}, which the rig is to record")
        return self

    @model_validator(mode="after")
    def _bands_reach_across(self) -> Params:
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
    known = getattr(params, f"{kind}s")
    if name not in known:
        raise UserError(
            f"{called or kind} {name}: not in params.yaml, which has {', '.join(known)}"
        )


def load(path: str | Path = "params.yaml") -> Params:
    """Read and check params.yaml. Raises UserError."""
    try:
        text = Path(path).read_text(encoding="utf-8")
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
    if not isinstance(content, dict):
        raise UserError(f"{name}: must hold a mapping of sections such as `run:` and `bands:`")
    try:
        return Params.model_validate(content)
    except ValidationError as error:
        raise UserError(f"{name}: {one_line(error, Params)}") from error
