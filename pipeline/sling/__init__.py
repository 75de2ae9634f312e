"""The sling simulator: mesh and material, implicit solver, recorded interaction, launch."""

from pipeline.sling.interaction import Rollouts, interact
from pipeline.sling.launch import Launches, launch
from pipeline.sling.material import THETA
from pipeline.sling.model import Sling

__all__ = ["THETA", "Launches", "Rollouts", "Sling", "interact", "launch"]
