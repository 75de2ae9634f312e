"""The sling simulator: mesh and material, implicit solver, recorded interaction, launch."""

from pipeline.simulator.interaction import Rollouts, interact
from pipeline.simulator.launch import Launches, launch
from pipeline.simulator.material import THETA
from pipeline.simulator.model import ClampedBand, LaunchSetup

__all__ = ["THETA", "ClampedBand", "LaunchSetup", "Launches", "Rollouts", "interact", "launch"]
