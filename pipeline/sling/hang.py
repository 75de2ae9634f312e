"""Statics: the band hanging from the fork's tips with a weight at its middle."""

from __future__ import annotations

import numpy as np

from pipeline.sling.initial import drawn_guess
from pipeline.sling.material import material
from pipeline.sling.model import Sling
from pipeline.sling.solver import (
    FAILURE,
    FREE,
    LANE_STATE,
    PAYLOAD,
    RELAX,
    Schedule,
    relaxation,
    run,
    steps,
)

LONG = 10.0 ** np.arange(1, 6)  # s: steps in which the weight's inertia counts for nothing


def hang(sling: Sling, thetas: np.ndarray, load: float) -> np.ndarray:
    """Nodes [m] of the band at rest under a weight at its middle, shape (N, sections, 3).

    NaN where the simulation did not converge. There is no floor.

    Args:
        thetas: Physical parameters, shape (N, 5) or (5,).
        load: The weight's mass [kg].
    """
    thetas = np.atleast_2d(thetas).astype(float)
    table = np.vstack([relaxation(FREE), steps(LONG, 1.0, hold=FREE, mode=RELAX)])
    lanes = np.zeros((len(thetas), LANE_STATE))
    lanes[:, PAYLOAD] = load
    result = run(
        sling,
        Schedule(table, first_free=len(table)),
        material(sling, thetas),
        drawn_guess(sling, np.array([[0.0, -sling.rest_length]]))[0],
        lanes,
        frame_steps=np.array([len(table) - 1]),
        frame_weights=np.ones(1),
    )
    nodes = result.frames[:, 0].astype(float)
    nodes[result.lane_state[:, FAILURE] > 0] = np.nan
    return nodes
