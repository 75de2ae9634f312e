"""What params.yaml says of the policy and of the launches that try it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sling2sim2real.base.schema import ASCENDING, FILLED, LIST, UNIQUE, Range, Section, Seed

Distance = Annotated[float, Range(0.1, 20)]  # along the floor, m


class LaunchParams(Section):
    """How a hand draws the band for a launch; None: as for the recording."""

    pull_time: Annotated[float, Range(0.05, 100)] | None = None
    pause: Annotated[float, Range(0, 1000)] | None = None


class Reward(Section):
    height: Annotated[float, Range(1e-3, 1e3)] = 5.0
    scale: Annotated[float, Range(1e-3, 10)] = 1.0
    penalty: Annotated[float, Range(0, 1e3)] = 1.0


Nodes = Annotated[int, Range(4, 1000)]  # a cubic spline needs four
Width = Annotated[int, Range(1, 4096)]


class PolicyParams(Section):
    seed: Seed = 1
    targets: Annotated[tuple[Distance, Distance], LIST, ASCENDING] = (1.425, 2.425)
    landings: Literal["map", "simulated"] = "map"
    exploration: Literal["scheduled", "learned"] = "scheduled"
    state: Literal["target", "projectile_target"] = "target"
    map_size: Annotated[tuple[Nodes, Nodes], LIST] = (33, 25)
    envs: Annotated[int, Range(2, 1_000_000)] = 512
    steps: Annotated[int, Range(2, 10_000)] = 4  # with 2 envs: one sample a mini-batch
    iterations: Annotated[int, Range(1, 100_000)] = 60
    hidden: Annotated[tuple[Width, ...], LIST, FILLED] = (256, 128, 64)
    learning_rate: Annotated[float, Range(1e-7, 1)] = 0.001
    init_std: Annotated[float, Range(1e-3, 10)] = 0.5
    final_std: Annotated[float, Range(1e-4, 10)] = 0.005
    reward: Reward = Field(default_factory=Reward)


class TrialsParams(Section):
    seed: Seed = 1
    targets: Annotated[tuple[Distance, ...], LIST, FILLED, UNIQUE] = (1.725, 1.925, 2.125)
    repeats: Annotated[int, Range(1, 10_000)] = 5
    actuation_error: Annotated[float, Range(0, 0.1)] = 0.001
