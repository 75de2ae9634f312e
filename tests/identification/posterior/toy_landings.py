"""Landings at two targets that are linear in four unknowns."""

import numpy as np

from sling2sim2real.identification.posterior.gain import LandingModel

NAMES = ["youngs_modulus", "elasticity_damping", "returned_share", "air_drag"]
RNG = np.random.default_rng(3)
ROOT = RNG.normal(size=(4, 4)) * 0.05
COVARIANCE = ROOT @ ROOT.T + np.diag([1e-4, 0.05, 2e-4, 0.1])
GRADIENT = np.array([[0.8, -0.2, 1.5, -0.01], [0.9, -0.25, 1.7, -0.02]])


def landing_model() -> LandingModel:
    draw = np.array([0.02, 0.03])
    spread = np.sqrt(np.einsum("td,de,te->t", GRADIENT, COVARIANCE, GRADIENT) + draw**2)
    return LandingModel(NAMES, COVARIANCE, GRADIENT, draw, 1.645 * spread)
