"""How far the rig's bands truly hang with a weight (pipeline/base/weight.py)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root_scalar

from pipeline.base.weight import LONGEST
from rig.physics.string import ElasticString

LOADED, HELD, STEP = 1.0, 10.0, 0.05  # s, in which it is loaded, and then hangs


def hanging_stretch(string: ElasticString, tension: float) -> float | None:
    """Stretch at which a strand holds `tension` [N] after HELD seconds; None where none does.

    The stretch grows evenly and is then held, so that the rubber relaxes rather than creeps. Its
    past is that of the recording: it softens no more until it is stretched further.
    """
    time = np.arange(0, LOADED + HELD + STEP, STEP)

    def missing(stretch: float) -> float:
        way = 1 + (stretch - 1) * np.minimum(time / LOADED, 1)
        _, memory = string.rubber.history(way, STEP, string.worst)
        return string.stiffness * float(string.rubber.response(way, memory)[0][-1]) - tension

    stretches = np.linspace(1.0, LONGEST, 45)
    for low, high in zip(stretches, stretches[1:], strict=False):  # some laws end before LONGEST
        ends = missing(low), missing(high)
        if not np.isfinite(ends).all():
            break
        if ends[1] > 0:
            return float(root_scalar(missing, bracket=(low, high)).root)
    return None
