"""An engine of a user's: ours, where every band is softer by half."""

from pipeline.episode.episode import Episode
from pipeline.simulator.interaction import Rollouts, interact
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters

SOFTER = 0.5
batches: list[int] = []


def simulate(
    band: ClampedBand, *, episode: Episode, parameters: Parameters, device: str
) -> Rollouts:
    batches.append(len(parameters))
    softer = SOFTER * parameters.column("youngs_modulus")
    return interact(band, episode, parameters.changed(youngs_modulus=softer))
