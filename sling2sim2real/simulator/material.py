"""The material law: what the native text takes for its parameters θ.

A law has four places: its rows in parameters.py, its coefficients here
(named in records.py), its stress and their derivative by the deformation gradient in material.h,
and the rod's bending and twist in rod.h. Whoever adds one writes it a second time in
validation/simulator/reference.py.
"""

from __future__ import annotations

import numpy as np

from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import THETA, Parameters
from sling2sim2real.simulator.records import MATERIAL
from sling2sim2real.simulator.rubber import RUBBER, relaxed

LEAST_DAMPING_SCALE = 0.0075  # without damping of shape waves ring for ever: no step holds them


def material(
    band: ClampedBand, parameters: Parameters, rigidity: float | np.ndarray | None = None
) -> np.ndarray:
    """Coefficients of the law, records (N,) of records.MATERIAL, for N parameters.

    mu is the shear modulus and lam the volume modulus of the stable neo-Hookean law without its
    logarithm (Smith, de Goes, Kim 2018): first Lame parameter plus mu, so that E and nu are the
    small-strain ones. `friction` is that of both pads. A damping_scale is at least
    LEAST_DAMPING_SCALE.

    Args:
        rigidity: Flexural, one or one a sample [N m^2]; None: the band's.

    Raises:
        ValueError: They are of another law than the band.
    """
    if parameters.law != band.law:
        raise ValueError(f"parameters of the law {parameters.law} for a band of {band.law}")
    young, poisson, damping, friction, scale = map(parameters.column, THETA)
    result = np.zeros(len(parameters), MATERIAL)
    if parameters.law == RUBBER:
        after, weight = relaxed(parameters.column("relaxation"))
        young = young * after
        result["mooney"] = parameters.column("mooney_share")
        result["upturn"] = parameters.column("upturn")
        result["softening"] = parameters.column("softening")
        result["relaxation"] = weight / after
        result["flow"] = parameters.column("flow") / after
        result["flow_rate"] = 10 ** parameters.column("log_flow_rate")
    result["mu"] = mu = young / (2 * (1 + poisson))
    result["lam"] = young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu
    result["damping"], result["scale"] = damping, np.maximum(scale, LEAST_DAMPING_SCALE)
    result["friction"] = 2 * friction
    rigidity = band.flexural_rigidity if rigidity is None else rigidity
    if rigidity is None:
        result["bending"] = (1 + poisson) * band.radius**2 / 2
    else:
        result["bending"] = rigidity / (mu * band.area)
    result["drag"] = parameters.column("air_drag")
    result["turning"] = parameters.column("turn_damping")
    return result
