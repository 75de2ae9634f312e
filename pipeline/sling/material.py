"""The material law's parameters, and what the native text takes for them.

The law itself, stress and its derivative by the deformation gradient, is material.h; rod.h adds the
rod's bending and twist to it.
"""

from __future__ import annotations

import numpy as np

from pipeline.sling.model import Sling

THETA = (
    "youngs_modulus",
    "poissons_ratio",
    "elasticity_damping",
    "dynamic_friction",
    "damping_scale",
)


def material(sling: Sling, thetas: np.ndarray) -> np.ndarray:
    """What state.h takes for physical thetas (N, 5): mu, lam, d, s, 2 friction, cb, drag; (N, 7).

    mu is the shear modulus and lam the volume modulus of the stable neo-Hookean law without its
    logarithm (Smith, de Goes, Kim 2018): first Lame parameter plus mu, so that E and nu are the
    small-strain ones.
    """
    young, poisson, damping, friction, scale = np.asarray(thetas, float).T
    mu = young / (2 * (1 + poisson))
    lam = young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu
    if sling.flexural_rigidity is None:
        bending = (1 + poisson) * sling.radius**2 / 2
    else:
        bending = sling.flexural_rigidity / (mu * sling.area)
    drag = np.broadcast_to(sling.air_drag, young.shape)
    return np.stack([mu, lam, damping, scale, 2 * friction, bending, drag], axis=1)
