"""The material law: its parameters θ, and what the native text takes for them.

A law has three places: its parameters and coefficients here (named in records.py), its stress and
their derivative by the deformation gradient in material.h, and the rod's bending and twist in
rod.h. Whoever adds one writes it a second time in validation/simulator/reference.py.
"""

from __future__ import annotations

import numpy as np

from pipeline.simulator.model import ClampedBand
from pipeline.simulator.records import MATERIAL

THETA = (
    "youngs_modulus",
    "poissons_ratio",
    "elasticity_damping",
    "dynamic_friction",
    "damping_scale",
)
LEAST_SCALE = 0.0075  # without any damping of shape waves ring on for ever, and no step holds them


def material(sling: ClampedBand, thetas: np.ndarray) -> np.ndarray:
    """Coefficients of the law, records (N,) of records.MATERIAL, for physical thetas (N, 5).

    mu is the shear modulus and lam the volume modulus of the stable neo-Hookean law without its
    logarithm (Smith, de Goes, Kim 2018): first Lame parameter plus mu, so that E and nu are the
    small-strain ones. `friction` is that of both pads. A damping_scale below LEAST_SCALE is taken
    as that.
    """
    young, poisson, damping, friction, scale = np.asarray(thetas, float).T
    result = np.empty(len(thetas), MATERIAL)
    result["mu"] = mu = young / (2 * (1 + poisson))
    result["lam"] = young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu
    result["damping"], result["scale"] = damping, np.maximum(scale, LEAST_SCALE)
    result["friction"] = 2 * friction
    if sling.flexural_rigidity is None:
        result["bending"] = (1 + poisson) * sling.radius**2 / 2
    else:
        result["bending"] = sling.flexural_rigidity / (mu * sling.area)
    result["drag"], result["turning"] = sling.air_drag, sling.turn_damping
    result["mooney"], result["relaxation"] = sling.mooney_share, sling.relaxation
    return result
