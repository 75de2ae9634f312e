"""Match a chain to the calibrated simulation, and prove it: the same hold, the same launches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from sling2sim2real.api.model import Model
from sling2sim2real.base.errors import UserError
from sling2sim2real.exporting.chain import MATCHED, Shot, SpringChain
from sling2sim2real.exporting.mujoco_replay import MujocoBand
from sling2sim2real.exporting.newton_replay import NewtonReplay
from sling2sim2real.simulator.launch import Launches

DRAWS_A_SIDE = 5  # draws along y and z over the box
TARGET_MARGIN = 1.6  # times nearer and farther than policy.targets: where launches are matched
FEWEST_DRAWS = 4  # of them that must land
PROOF_DEPTHS = (0.15, 0.35, 0.55)  # of the box along y, for the proof: none is on the grid
PROOF_PLACES = 41  # places along z for it
LOST_LAUNCH_ERROR = 1.0  # relative error of a launch that nothing leaves
HOLD_LIMIT, LANDING_LIMIT = 0.02, 0.03  # relative errors that weigh alike: what is asked
STRENGTH_REACH, MOONEY_REACH = 0.4, 0.6  # from the guess of a match: logarithm, difference
MOST_EVALUATIONS = 12  # of the search, at most


@dataclass(frozen=True)
class DrawCompared:
    """A draw in both simulations: (calibrated, target's), SI units."""

    draw: tuple[float, float]
    hold_force: tuple[float, float]
    speed: tuple[float, float]
    landing: tuple[float, float]

    @property
    def errors(self) -> dict[str, float]:
        """Relative errors of the target's values."""
        pairs = {name: getattr(self, name) for name in ("hold_force", "speed", "landing")}
        return {name: theirs / ours - 1 for name, (ours, theirs) in pairs.items()}


@dataclass(frozen=True)
class Matched:
    """What the match and the proof came to.

    Attributes:
        chain: Matched.
        match: Draws that it was matched to.
        proof: Draws that it was not, flown to the floor.
        finer: Largest relative change of the proof's landings with half the time step.
        engine: Name and version.
    """

    chain: SpringChain
    match: Sequence[DrawCompared]
    proof: Sequence[DrawCompared]
    finer: float
    engine: str

    @property
    def met(self) -> bool:
        return within_limits(self.proof)


def draws_of(model: Model) -> tuple[np.ndarray, Launches]:
    """Draws (N, 2) of a grid over the box that land around the targets, and their launches.

    Those that the arm may hold. Raises UserError where there are too few.
    """
    setup, (near, far) = model.settings.setup, model.settings.policy.targets
    axes = [np.linspace(*box, DRAWS_A_SIDE) for box in (setup.draw_y, setup.draw_z)]
    draws = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    done = model.launches(draws)
    with np.errstate(invalid="ignore"):
        good = (done.landing_y > near / TARGET_MARGIN) & (done.landing_y < far * TARGET_MARGIN)
        good &= done.hold_force <= setup.max_force
    if good.sum() < FEWEST_DRAWS:
        raise UserError(
            f"{model.band.name}: {good.sum()} of {len(draws)} draws of the box (setup.draw_y, "
            f"draw_z) land near policy.targets within setup.max_force; a match needs {FEWEST_DRAWS}"
        )
    return draws[good], done[good]


def within_limits(proof: Sequence[DrawCompared]) -> bool:
    """Whether each draw is held and lands as near as is asked: HOLD_LIMIT, LANDING_LIMIT."""
    return all(
        abs(draw.errors["hold_force"]) <= HOLD_LIMIT
        and abs(draw.errors["landing"]) <= LANDING_LIMIT
        for draw in proof
    )


def compared(
    model: Model, draws: np.ndarray, shots: list[Shot], theta: np.ndarray | None = None
) -> list[DrawCompared]:
    """Shots of draws (N, 2) beside what the calibrated simulation does there.

    Args:
        theta: Other than the model's, shape (P,).
    """
    done = model.launches(draws, None if theta is None else np.tile(theta, (len(draws), 1)))
    return [
        DrawCompared(
            draw=(float(draw[0]), float(draw[1])),
            hold_force=(float(done.hold_force[i]), shot.hold_force),
            speed=(float(done.speed[i]), shot.speed),
            landing=(float(done.landing_y[i]), shot.landing),
        )
        for i, (draw, shot) in enumerate(zip(draws, shots, strict=True))
    ]


def matched(model: Model) -> SpringChain:
    """The chain whose held forces and landings around the targets are nearest to ours.

    Raises:
        UserError: MuJoCo is not installed, or too few draws of the box land.
    """
    draws, ours = draws_of(model)
    chain = _fitted(SpringChain.of(model, draws, ours.hold_force), draws, ours)
    while (step := chain.stable_step) < chain.step:  # it is braked more than was thought
        chain = _fitted(replace(chain, step=step), draws, ours)
    return chain


def _fitted(start: SpringChain, draws: np.ndarray, ours: Launches) -> SpringChain:
    """The best chain with the time step of `start`."""

    def chain_at(point: np.ndarray) -> SpringChain:
        strength, damping = np.exp(point[[0, 2]] - 1)
        return replace(
            start,
            strength=float(start.strength * strength),
            mooney_share=float(start.mooney_share + point[1] - 1),
            damping_time=float(start.damping_time * damping),
        )

    def errors(point: np.ndarray) -> np.ndarray:
        chain = chain_at(point)
        shots = MujocoBand(chain).launches(draws)
        both = [
            [
                (shot.hold_force / hold - 1) / HOLD_LIMIT,
                (shot.landing / landing - 1) / LANDING_LIMIT,
            ]
            for shot, hold, landing in zip(shots, ours.hold_force, ours.landing_y, strict=True)
        ]
        return np.nan_to_num(np.ravel(both), nan=LOST_LAUNCH_ERROR / LANDING_LIMIT)

    most = start.most_damping / start.damping_time
    limits = np.array(
        [
            [-STRENGTH_REACH, -MOONEY_REACH, -np.log(20)],
            [STRENGTH_REACH, MOONEY_REACH, np.log(most)],
        ]
    )
    solution = least_squares(
        errors, np.ones(len(MATCHED)), bounds=1 + limits,  # about 1: steps are relative
        diff_step=1e-2, x_scale=[0.1, 0.1, 1.0], xtol=1e-5, ftol=1e-6, max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    return chain_at(solution.x)


def proof_draws(model: Model) -> np.ndarray:
    """A draw for each of three targets that no match has seen, shape (3, 2).

    The farther the target, the farther from the fork along y; along z what lands nearest.
    """
    setup, targets = model.settings.setup, model.settings.trials.targets
    wanted = np.linspace(min(targets), max(targets), len(PROOF_DEPTHS))
    far, near = sorted(setup.draw_y)
    low, high = sorted(setup.draw_z)
    across = np.linspace(low, high, PROOF_PLACES)
    nearest = []
    for target, depth in zip(wanted, PROOF_DEPTHS, strict=True):
        draws = np.column_stack([np.full(PROOF_PLACES, near + depth * (far - near)), across])
        miss = np.abs(model.launches(draws).landing_y - target)
        if np.isnan(miss).all():
            raise UserError(
                f"{model.band.name}: no draw at y = {draws[0, 0]:g} m lands, to prove the export"
            )
        nearest.append(draws[np.nanargmin(miss)])
    return np.array(nearest)


def proven(model: Model, replay: MujocoBand | NewtonReplay, proof: np.ndarray) -> Matched:
    """What a matched chain's replay leaves of the match's draws and of those of `proof` (N, 2)."""
    (draws, _), shots = draws_of(model), replay.launches(proof, fly=True)
    finer = replay.finer.launches(proof)
    moved = [half.landing / shot.landing - 1 for half, shot in zip(finer, shots, strict=True)]
    return Matched(
        chain=replay.chain,
        match=compared(model, draws, replay.launches(draws)),
        proof=compared(model, proof, shots),
        finer=max(map(abs, moved)),
        engine=replay.engine,
    )
