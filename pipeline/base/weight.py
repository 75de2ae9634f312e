"""The weight that the paper hangs on its bands (its figure 3), for simulators and for the rig.

The caption says that each band is clamped at half of its full length. That can be read in two ways:
the band hangs folded and both halves share the weight, or one half carries it all (READINGS).
"""

from __future__ import annotations

WEIGHT = 1.5  # kg
READINGS = {2: "both halves share it", 1: "one half carries it"}  # by strands
LONGEST = 12.0  # stretch up to which a law is asked


def tension(strands: int) -> float:
    """Tension of each strand [N]; the band's own weight is a hundredth of it, and left out."""
    return WEIGHT * 9.81 / strands
