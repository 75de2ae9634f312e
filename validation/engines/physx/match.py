"""Match an exported band in PhysX: Young's modulus to the force held, the mass to the landings.

`sling export --to usd` calls it where PhysX and a GPU are there. PhysX's damping changes what the
band holds; so the band has none, and would be too fast: the mass stands in for what a launch loses.
Bands of nine pairs of modulus and mass are launched, three at once; errors are taken as linear in
the logarithms of both, which fits them and averages over what PhysX scatters. Then the stage itself
is launched, one draw after the other: those of the match, and three that took no part.
"""

from __future__ import annotations

import os
from dataclasses import replace

import numpy as np
import warp as wp

from pipeline.base.errors import UserError
from pipeline.export import usd
from pipeline.export.band import CalibratedBand
from pipeline.export.match import HOLD, LANDING, compared, proof_draws
from pipeline.export.usd import ITERATIONS, RATE, UsdBand, UsdMatch, near_draws
from pipeline.simulator.launch import Launches
from validation.engines.physx import scene
from validation.engines.physx.bands import INTERPRETER, Engine, release
from validation.engines.physx.exported import launched, yielded

ROUNDS = (0.08, 0.25), (0.04, 0.10)  # logarithms of modulus and mass to both sides, each round
FARTHEST = 0.5  # of either logarithm from where the match begins


def matched(model: CalibratedBand, band: UsdBand) -> UsdMatch | None:
    """The band as PhysX wants it, and what that leaves; None where there is no PhysX or no GPU.

    Raises UserError where the Python that SLING_PHYSX names has none, or PhysX fails.
    """
    try:
        version = release()
    except UserError:
        if os.environ.get(INTERPRETER):
            raise
        return None
    if not wp.is_cuda_available():
        return None
    with Engine() as engine:
        best = fitted(engine, model, band)
        (near, _), others = near_draws(model), proof_draws(model)
        match, proof, on_paper = (
            compared(model, draws, _launched_singly(engine, model, same, draws))
            for same, draws in ((best, near), (best, others), (band, others))
        )
    return UsdMatch(best, match, proof, on_paper, f"PhysX (ovphysx {version})")


def fitted(engine: Engine, model: CalibratedBand, band: UsdBand) -> UsdBand:
    """Modulus and mass of which `near_draws` are held and land as in the calibrated simulation."""
    (draws, ours), point = near_draws(model), np.zeros(2)
    for widths in ROUNDS:
        grid = point + np.array(
            [[side * widths[0], other * widths[1]] for other in (-1, 0, 1) for side in (-1, 0, 1)]
        )
        errors = np.concatenate(
            [_errors(engine, model, band, draws, ours, same) for same in np.split(grid, 3)]
        )
        point = np.clip(_least(grid, errors), -FARTHEST, FARTHEST)
    return changed(band, point)


def changed(band: UsdBand, point: np.ndarray) -> UsdBand:
    """The band with modulus and mass times e to `point` (2,)."""
    young, mass = np.exp(point)
    tube = replace(band.tube, mass=mass * band.tube.mass)
    return replace(band, tube=tube, young=young * band.young)


def _least(grid: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Where a linear model of errors (P, R) at points (P, 2) is least, in their squares."""
    terms = np.column_stack([np.ones(len(grid)), grid])
    sound = np.isfinite(errors).all(axis=0)
    if not sound.any():
        raise UserError("PhysX: no draw of the match lands; the stage is not matched")
    model = np.linalg.lstsq(terms, errors[:, sound], rcond=None)[0]
    return np.linalg.lstsq(model[1:].T, -model[0], rcond=None)[0]


def _errors(
    engine: Engine, model: CalibratedBand, band: UsdBand, draws, ours: Launches, grid: np.ndarray
) -> np.ndarray:
    """Errors over what is asked, of forces and landings, at points (P, 2) of one mass: (P, 2 N)."""
    count = len(draws)
    heavy = changed(band, np.array([0.0, grid[0, 1]]))
    youngs = np.repeat(band.young * np.exp(grid[:, 0]), count)
    thetas = np.column_stack(
        [youngs, *(np.full(len(youngs), x) for x in (band.poisson, 0.0, band.friction, 1.0))]
    )
    stage = scene.text(heavy.tube, thetas, RATE, ITERATIONS)
    shots = launched(
        engine, stage, heavy, model.sling, model.launch_setup,
        np.tile(_places(model, draws, ours), (len(grid), 1)),
        offsets=scene.offsets(len(youngs)), youngs=youngs,
    )  # fmt: skip
    there = np.array([[shot.hold_force, shot.landing] for shot in shots]).reshape(-1, count, 2)
    wanted = np.column_stack([ours.hold_force, ours.landing_y])
    return ((there / wanted - 1) / [HOLD, LANDING]).reshape(len(grid), -1)


def _launched_singly(engine: Engine, model: CalibratedBand, band: UsdBand, draws: np.ndarray):
    """Shots of the written stage, each from draw (N, 2) of its own."""
    places = _places(model, draws, model.launches(draws))
    stage = usd.text(band)
    return [
        launched(engine, stage, band, model.sling, model.launch_setup, place[None])[0]
        for place in places
    ]


def _places(model: CalibratedBand, draws: np.ndarray, ours: Launches) -> np.ndarray:
    """Where the hand rests (N, 2): the arm gives way as much as in the calibrated simulation."""
    return yielded(draws, ours.hold_force, model.launch_setup.arm_stiffness)
