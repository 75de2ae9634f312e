"""An engine of a user's: ours, where every band is softer by half."""

from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator.interaction import Rollouts, interact
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters

SOFTER = 0.5
batches: list[int] = []


def simulate(
    band: ClampedBand, *, episode: Episode, parameters: Parameters, device: str
) -> Rollouts:
    batches.append(len(parameters))
    softer = SOFTER * parameters.column("youngs_modulus")
    return interact(band, episode, parameters.changed(youngs_modulus=softer))
