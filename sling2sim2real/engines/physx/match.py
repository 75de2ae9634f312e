"""Match an exported band in PhysX, to the forces held and the landings of the calibrated one.

`sling export --to usd` calls it where PhysX and a GPU are there. Four values are matched, in two
rounds of bands that are launched many at once; errors are taken as linear in them, which averages
over what PhysX scatters:

- Young's modulus, to the force held;
- the mass. PhysX's damping changes what the band holds; so the band has none, and would be too
  fast: the mass stands in for what a launch loses;
- the rest length, by which the force grows otherwise with the draw: PhysX's law is another;
- how high the clamps lie, which turns all launches up or down: else flat ones land too near and
  steep ones too far (reports/validation/export-usd.json, by modulus and mass alone).

Then the stage itself is launched, one draw after the other, and corrected by its own errors there:
those of the draws of the match. Three draws that took no part are launched last.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import warp as wp
from scipy.optimize import lsq_linear

from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.engines.physx import scene
from sling2sim2real.engines.physx.bands import INTERPRETER, Engine, release
from sling2sim2real.engines.physx.launches import launched
from sling2sim2real.exporting import usd
from sling2sim2real.exporting.chain import Shot
from sling2sim2real.exporting.match import (
    HOLD_LIMIT,
    LANDING_LIMIT,
    LOST_LAUNCH_ERROR,
    compared,
    proof_draws,
)
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import EDGES, GRADING, UsdBand, UsdMatch, near_draws
from sling2sim2real.simulator.launch import Launches

# Logarithms of modulus, mass and rest length; the clamps' height [m].
ROUND_WIDTHS = np.array([0.08, 0.25, 0.03, 0.01])  # to both sides, in the first round
FARTHEST_POINT = np.array([0.5, 0.8, 0.1, 0.03])  # from where the match begins
ROUNDS = 1.0, 0.5  # of ROUND_WIDTHS
CORRECTIONS = 2  # by the errors of the stage itself
LONGEST_MATCH_S = 300.0  # s, after which nothing more is tried
ONE_BY_ONE = np.concatenate([np.zeros((1, 4)), np.eye(4)[1:], -np.eye(4)[1:]])  # a mesh each
SCENES = ONE_BY_ONE[:, None] + np.outer([-1, 0, 1], np.eye(4)[0])  # in each three moduli, (7, 3, 4)


def matched(model: Model, band: UsdBand) -> UsdMatch | None:
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
        best, shots = fitted(engine, model, band)
        (near, _), others = near_draws(model), proof_draws(model)
        proof, on_paper = (
            compared(model, others, _launched_singly(engine, model, same, others))
            for same in (best, band)
        )
    match = compared(model, near, shots)
    return UsdMatch(best, match, proof, on_paper, f"PhysX (ovphysx {version})")


def fitted(
    engine: Engine, model: Model, band: UsdBand, *, corrections: int = CORRECTIONS
) -> tuple[UsdBand, list[Shot]]:
    """The band of which `near_draws` are held and land as in the calibrated simulation.

    Returns:
        It, and the shots of its stage from those draws.
    """
    (draws, ours), point, say = near_draws(model), np.zeros(4), _clock(model.band.name)
    slopes = np.empty((0, 4))
    for number, share in enumerate(ROUNDS, 1):
        if number > 1 and say(f"round {number - 1} of {len(ROUNDS)}", point) > LONGEST_MATCH_S:
            break
        grids = point + share * ROUND_WIDTHS * SCENES
        errors = []
        for i, grid in enumerate(grids, 1):
            errors.append(_errors(engine, model, band, draws, ours, grid))
            say(f"round {number}, scene {i} of {len(grids)}")
        constant, slopes = _linear(np.concatenate(grids), np.concatenate(errors))
        point = _least(constant, slopes)
    tried = []
    for number in range(corrections + 1):
        same = changed(model, band, point)
        shots = _launched_singly(engine, model, same, draws)
        left = _relative(shots, ours)
        size = np.linalg.norm(np.nan_to_num(left, nan=LOST_LAUNCH_ERROR / LANDING_LIMIT))
        tried.append((float(size), same, shots))
        if say(f"stage {number + 1}, {_worst(shots, ours)}", point) > LONGEST_MATCH_S:
            break
        point = _least(left - slopes @ point, slopes)
    return min(tried, key=lambda trial: trial[0])[1:]


def changed(model: Model, band: UsdBand, point: np.ndarray) -> UsdBand:
    """The band with modulus, mass, rest length times e to point[:3], clamps raised by the last."""
    young, mass, length = np.exp(point[:3])
    sling = replace(model.sling, rest_length=length * model.sling.rest_length)
    tube = Tube.of(sling, EDGES, GRADING)
    up = np.array([0.0, 0.0, point[3]])
    moved = {"hanging": tube.hanging + up, "clamped": tube.clamped + up}
    return replace(
        band, tube=replace(tube, mass=mass * tube.mass, **moved), young=young * band.young
    )


def _linear(grid: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A linear model of errors (P, R) at points (P, K): at the origin (R,), and slopes (R, K).

    Not a number for an error that is lost at a point.
    """
    terms = np.column_stack([np.ones(len(grid)), grid])
    sound = np.isfinite(errors).all(axis=0)
    if not sound.any():
        raise UserError("PhysX: no draw of the match lands; the stage is not matched")
    model = np.full((terms.shape[1], errors.shape[1]), np.nan)
    model[:, sound] = np.linalg.lstsq(terms, errors[:, sound], rcond=None)[0]
    return model[0], model[1:].T


def _least(constant: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Where errors (R,) + slopes (R, K) point are least in their squares, within FARTHEST_POINT.

    Beside them stands the way from the origin, so that nothing goes far for nothing.
    """
    sound = np.isfinite(constant) & np.isfinite(slopes).all(axis=1)
    rows = np.concatenate([slopes[sound], np.diag(1 / FARTHEST_POINT)])
    wanted = np.concatenate([-constant[sound], np.zeros(len(FARTHEST_POINT))])
    return lsq_linear(rows, wanted, (-FARTHEST_POINT, FARTHEST_POINT)).x


def _errors(
    engine: Engine, model: Model, band: UsdBand, draws, ours: Launches, grid: np.ndarray
) -> np.ndarray:
    """Errors of forces and landings, at points (P, 4) of one mesh: (P, 2 N)."""
    count, same = len(draws), changed(model, band, grid[0])
    places = np.tile(_places(model, draws, ours), (len(grid), 1))
    thetas = _thetas(same, np.repeat(band.young * np.exp(grid[:, 0]), count))
    stage = scene.text(same.tube, thetas)
    shots = _shots(engine, stage, model, same.tube, thetas, places)
    starts = range(0, len(shots), count)
    return np.array([_relative(shots[start : start + count], ours) for start in starts])


@np.errstate(all="ignore")  # what does not land
def _relative(shots: Sequence[Shot], ours: Launches) -> np.ndarray:
    """Logarithms of forces and landings over ours, of what is asked, shape (2 N,)."""
    there = np.array([[shot.hold_force, shot.landing] for shot in shots])
    wanted = np.column_stack([ours.hold_force, ours.landing_y])
    return (np.log(there / wanted) / [HOLD_LIMIT, LANDING_LIMIT]).ravel()


def _worst(shots: Sequence[Shot], ours: Launches) -> str:
    force, landing = np.abs(_relative(shots, ours).reshape(-1, 2)).max(axis=0) * [
        HOLD_LIMIT,
        LANDING_LIMIT,
    ]
    return f"at most {100 * force:.1f} % of a force and {100 * landing:.1f} % of a landing off"


def _clock(name: str) -> Callable[..., float]:
    """Something that says how far the match of a band is, and returns the seconds that it took."""
    began = time.monotonic()

    def say(what: str, point: np.ndarray | None = None) -> float:
        passed = time.monotonic() - began
        at = "" if point is None else f"; modulus, mass, length, height {np.round(point, 4)}"
        print(f"{name} in PhysX, {passed:.0f} s: {what}{at}", file=sys.stderr, flush=True)
        return passed

    return say


def _launched_singly(engine: Engine, model: Model, band: UsdBand, draws: np.ndarray) -> list[Shot]:
    """Shots of the written stage, each from draw (N, 2) of its own."""
    places = _places(model, draws, model.launches(draws))
    stage, theta = usd.text(band), _thetas(band, np.array([band.young]))
    return [_shots(engine, stage, model, band.tube, theta, place[None])[0] for place in places]


def _shots(engine: Engine, stage: str, model: Model, tube: Tube, thetas, places):
    """Launches of a stage's bands, one by one."""
    done = launched(engine, stage, tube, thetas, model.sling, model.launch_setup, places)
    rows = zip(done.landing_y, done.speed, done.angle, done.hold_force, strict=True)
    return [Shot(*map(float, row)) for row in rows]


def _thetas(band: UsdBand, youngs: np.ndarray) -> np.ndarray:
    """Parameters of bands of Young's moduli (N,) [Pa], shape (N, 5); a stage has no damping."""
    rest = np.tile([band.poisson, 0.0, band.friction, 1.0], (len(youngs), 1))
    return np.column_stack([youngs, rest])


def _places(model: Model, draws: np.ndarray, ours: Launches) -> np.ndarray:
    """Where the hand rests (N, 2): the arm gives way as much as in the calibrated simulation."""
    return yielded(draws, ours.hold_force, model.launch_setup.arm_stiffness)


def yielded(draws: np.ndarray, force: np.ndarray, stiffness: float | None) -> np.ndarray:
    """Where the middle rests (N, 2) when an arm of a stiffness [N/m] is sent to draws (N, 2)."""
    length = np.linalg.norm(draws, axis=1, keepdims=True)
    given_way = np.asarray(force)[:, None] / stiffness if stiffness else 0.0
    return draws * (1 - given_way / length)
