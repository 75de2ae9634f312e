"""How long a band hangs with a weight (base/weight.py) by its calibrated simulator."""

from __future__ import annotations

import numpy as np
from scipy.optimize import root_scalar

from pipeline.base.weight import LONGEST, tension
from pipeline.simulator.model import ClampedBand
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.rubber import RUBBER, uniaxial


def hanging_stretch(sling: ClampedBand, parameters: Parameters, strands: int) -> float:
    """Stretch of a strand by the calibrated law, ten seconds after it was loaded.

    That is where the law `rubber` has its modulus (simulator/rubber.py). Rubber is taken as
    incompressible and as never loaded before. NaN: beyond LONGEST.

    Args:
        parameters: One sample.
    """
    value = parameters.sample()
    shape = ("mooney_share", "upturn") if parameters.law == RUBBER else ()
    curve = [value[name] for name in shape] or [0.0]
    shear = value["youngs_modulus"] / 3

    def missing(stretch: float) -> float:
        stress = shear * float(uniaxial(np.array(stretch), *curve))
        return stress * sling.area - tension(strands)

    if missing(LONGEST) < 0:
        return float("nan")
    return float(root_scalar(missing, bracket=(1.0, LONGEST)).root)
