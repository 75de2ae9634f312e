"""The sling simulator: mesh and material, implicit solver, recorded interaction, launch."""

from pipeline.simulator.interaction import Rollouts, interact
from pipeline.simulator.launch import Launches, launch
from pipeline.simulator.model import ClampedBand, LaunchSetup
from pipeline.simulator.parameters import THETA, Parameters

__all__ = [
    "THETA",
    "ClampedBand",
    "LaunchSetup",
    "Launches",
    "Parameters",
    "Rollouts",
    "interact",
    "launch",
]
