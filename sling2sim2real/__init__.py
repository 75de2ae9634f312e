"""Sling2Sim2Real for Python: from a recorded pull of an elastic band to aimed launches.

    import sling2sim2real as s2s

    band = s2s.Band(mass=0.0408, diameter=0.010, rest_length=0.52)
    episodes = s2s.read_mcap("my.mcap", band)            # or s2s.episode_from_arrays(...)
    identification = s2s.identify(episodes, band)        # θ, intervals, samples
    aimed = s2s.aim(identification, target=1.9)          # draw, prediction, 90 % interval
    seen = s2s.Observed(aimed.draw, error=1e-3, landing=1.84)   # you launched: it landed there
    identification = s2s.identify(episodes, band, start=identification, launches=[seen])

SI units throughout. Frame O: origin midway between the fork's tips, x along the fork, y towards the
target, z up. Nothing is read from or written to disk but by functions that take a path. Bad input
is a `UserError` of one line.
"""

from importlib import metadata

from sling2sim2real import own  # noqa: F401 - before all that imports `pipeline`

# isort: split
from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.identify.posterior.launches import Observed
from pipeline.identify.results.mounting import Mounting
from pipeline.simulator.model import LaunchHistory
from sling2sim2real.episodes import episode_from_arrays, read_mcap
from sling2sim2real.exporting import Exported, export
from sling2sim2real.identification import Identification, Interval, identify
from sling2sim2real.launching import Aim, Launch, aim, launch
from sling2sim2real.model import Band, Model, Theta
from sling2sim2real.objective import Objective
from sling2sim2real.rehearsal import rehearse
from sling2sim2real.settings import Settings
from sling2sim2real.simulation import Simulation, pull, simulate, simulate_batch

__all__ = [
    "Aim",
    "Band",
    "Episode",
    "Exported",
    "Identification",
    "Interval",
    "Launch",
    "LaunchHistory",
    "Model",
    "Mounting",
    "Objective",
    "Observed",
    "Settings",
    "Simulation",
    "Theta",
    "UserError",
    "aim",
    "episode_from_arrays",
    "export",
    "identify",
    "launch",
    "pull",
    "read_mcap",
    "rehearse",
    "simulate",
    "simulate_batch",
]

try:
    __version__ = metadata.version("sling2sim2real")
except metadata.PackageNotFoundError:  # run from a folder that was never installed
    __version__ = "unknown"
