"""Statics: the band hanging from the fork's tips with a weight at its middle."""

from __future__ import annotations

import numpy as np

from pipeline.sling.initial import drawn_guess
from pipeline.sling.model import Sling
from pipeline.sling.records import Grip
from pipeline.sling.schedule import Schedule, statics
from pipeline.sling.solver import Frames, Slings, run


def hang(sling: Sling, thetas: np.ndarray, load: float) -> np.ndarray:
    """Nodes [m] of the band at rest under a weight at its middle, shape (N, sections, 3).

    NaN where the simulation did not converge. There is no floor.

    Args:
        thetas: Physical parameters, shape (N, 5) or (5,).
        load: The weight's mass [kg].
    """
    thetas = np.atleast_2d(thetas).astype(float)
    steps = statics(Grip.FREE)
    guess = drawn_guess(sling, np.array([[0.0, -sling.rest_length]]))[0]
    slings = Slings.of(sling, thetas, guess, payload=load)
    last = Frames(np.array([len(steps) - 1]), np.ones(1))
    done = run(sling, Schedule(steps, first_free=len(steps)), slings, last)
    nodes = done.frames[:, 0].astype(float)
    nodes[done.lanes["outcome"] > 0] = np.nan
    return nodes
