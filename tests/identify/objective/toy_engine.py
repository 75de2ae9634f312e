"""An engine of a user's: ours, where every band is softer by half."""

import numpy as np

from pipeline.simulator.interaction import interact

SOFTER = np.array([0.5, 1.0, 1.0, 1.0, 1.0])
batches: list[int] = []


def simulate(sling, *, episode, thetas, device):
    batches.append(len(thetas))
    return interact(sling, episode, thetas * SOFTER)
