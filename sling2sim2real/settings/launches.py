"""What params.yaml says of the policy and of the launches that try it."""

from __future__ import annotations

from typing import Annotated, Literal

from sling2sim2real.base.schema import ASCENDING, FILLED, LIST, UNIQUE, Range, Section, Seed

Distance = Annotated[float, Range(0.1, 20)]  # along the floor, m


class LaunchParams(Section):
    """How a hand draws the band for a launch; None: as for the recording."""

    pull_time: Annotated[float, Range(0.05, 100)] | None
    pause: Annotated[float, Range(0, 1000)] | None


class Reward(Section):
    height: Annotated[float, Range(1e-3, 1e3)]
    scale: Annotated[float, Range(1e-3, 10)]
    penalty: Annotated[float, Range(0, 1e3)]


Nodes = Annotated[int, Range(4, 1000)]  # a cubic spline needs four
Width = Annotated[int, Range(1, 4096)]


class PolicyParams(Section):
    seed: Seed
    targets: Annotated[tuple[Distance, Distance], LIST, ASCENDING]
    landings: Literal["map", "simulated"]
    exploration: Literal["scheduled", "learned"]
    state: Literal["target", "projectile_target"]
    map_size: Annotated[tuple[Nodes, Nodes], LIST]
    envs: Annotated[int, Range(2, 1_000_000)]
    steps: Annotated[int, Range(2, 10_000)]  # with 2 envs: one sample a mini-batch
    iterations: Annotated[int, Range(1, 100_000)]
    hidden: Annotated[tuple[Width, ...], LIST, FILLED]
    learning_rate: Annotated[float, Range(1e-7, 1)]
    init_std: Annotated[float, Range(1e-3, 10)]
    final_std: Annotated[float, Range(1e-4, 10)]
    reward: Reward


class FloorParams(Section):
    """How far launches of an oracle policy miss: what no method can help."""

    map_size: Annotated[tuple[Nodes, Nodes], LIST]
    launches: Annotated[int, Range(0, 10_000)]  # a target, beside those with the trials' errors


class TrialsParams(Section):
    seed: Seed
    targets: Annotated[tuple[Distance, ...], LIST, FILLED, UNIQUE]
    repeats: Annotated[int, Range(1, 10_000)]
    actuation_error: Annotated[float, Range(0, 0.1)]
