"""The sling simulator: mesh and material, implicit solver, recorded interaction, launch."""

from sling2sim2real.simulator.interaction import Rollouts, interact
from sling2sim2real.simulator.launch import Launches, launch
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import THETA, Parameters

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
