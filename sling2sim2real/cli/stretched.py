"""Whether a draw stretched a band further than ever: rubber softens up to its largest stretch."""

from __future__ import annotations

import numpy as np

from sling2sim2real.settings.lab import SetupParams
from sling2sim2real.simulator.model import BandSizes, first_draw

# Of a stretch. Up to this much further, the law rubber (simulator/rubber.py) moves the force at the
# old largest stretch by 3 % of the softening at most.
FURTHER = 0.01


def further(band: BandSizes, setup: SetupParams, before: float, draw: float) -> bool:
    """Whether a draw [m] stretches a band further than any.

    Args:
        before: Largest draw that was recorded or launched before it [m]; what the band saw before
            its recordings, it says itself (`preconditioned`).
    """
    draws = np.array([max(before, first_draw(band)), draw])
    recorded, now = 2 * np.hypot(setup.fork_width / 2, draws) / band.rest_length
    return bool(now > max(recorded, 1.0) + FURTHER)
