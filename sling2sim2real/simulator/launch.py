"""Launches: the projectile in the pouch, from a static draw to the floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from sling2sim2real.base.failures import DRAGGED, FOOT, NEVER_LEFT, SHORT, SLACK, too_strong
from sling2sim2real.simulator.initial import drawn_guess
from sling2sim2real.simulator.model import GRAVITY, ClampedBand, LaunchHistory, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip, Outcome
from sling2sim2real.simulator.rubber import BRANCH_TIMES_S, RUBBER, flowing, overstress, uniaxial
from sling2sim2real.simulator.schedule import RELAX_STEPS, Schedule, relaxation, steps
from sling2sim2real.simulator.solver import Options, Slings, run

HISTORY_STEPS = 200  # of a pull
NUDGE_M = 1e-3  # m of a draw, small against its box and large against the simulator's rounding
CENTRAL_DIFFERENCES_M = NUDGE_M * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])


@dataclass(frozen=True)
class Launches:
    """Outcome of N launches, frame O, SI units; NaN where `failure` names why there is none.

    Attributes:
        landing_y: Where the projectile meets the floor, shape (N,).
        speed, angle: Of the projectile as it leaves the pouch [m/s, rad above the horizon].
        hold_force: Of the drawn band on the hand, shape (N,); known for failed launches too,
            but for those that did not converge.
        separation_time: After the release [s].
        separation_y, separation_z: Where it leaves.
        failure: None, or the reason, length N.
    """

    landing_y: np.ndarray
    speed: np.ndarray
    angle: np.ndarray
    hold_force: np.ndarray
    separation_time: np.ndarray
    separation_y: np.ndarray
    separation_z: np.ndarray
    failure: list[str | None]

    def __getitem__(self, chosen: np.ndarray) -> Launches:
        """Launches by their numbers or a mask."""
        columns: dict[str, Any] = {
            field.name: np.array(getattr(self, field.name))[chosen] for field in fields(self)
        }
        columns["failure"] = columns["failure"].tolist()
        return Launches(**columns)


def ballistic_landing(y, z, vy, vz, floor: float):
    """Where a free projectile from (y, z) with (vy, vz) meets z = floor, without drag."""
    flight = (vz + np.sqrt(vz**2 + 2 * GRAVITY * np.maximum(z - floor, 0))) / GRAVITY
    return y + vy * flight


def schedule_of(setup: LaunchSetup, refine: int = 1) -> Schedule:
    """Relax at the draw, where the arm gives way; then recoil in second-order steps."""
    relax = relaxation(Grip.POUCH)
    relax["blend"] = 1.0
    if setup.arm_stiffness is not None:
        relax["compliance"][relax["bending"] == 1] = 1 / setup.arm_stiffness
    h = setup.step / refine
    count = int(round(setup.duration / h))
    first = steps([0.0, h], h, grip=Grip.FREE)
    rest = steps(h * np.arange(1, count + 1), h, grip=Grip.FREE, order=2)
    return Schedule(np.concatenate([relax, first, rest]), first_free=RELAX_STEPS)


def memory_of_pull(
    band: ClampedBand, history: LaunchHistory | None, parameters: Parameters, draws: np.ndarray
) -> dict[str, np.ndarray]:
    """What a drawn band's branches carry, each over its stress at rest, by fields of records.LANE.

    Of draws (N, 2) by a history, the band's halves taken as straight and, while they are slack, as
    unstretched. A band that is not stretched there carries nothing.

    Returns:
        `unrelaxed` (N, 8) and `unflowed` (N,).
    """
    count = len(draws)
    if band.law != RUBBER or history is None:
        return {"unrelaxed": np.zeros((count, len(BRANCH_TIMES_S))), "unflowed": np.zeros(count)}
    part = np.linspace(0, 1, HISTORY_STEPS + 1)
    drawn = np.linalg.norm(draws, axis=1)[:, None] * (part**2 * (3 - 2 * part))
    shape = (parameters.column(name)[:, None] for name in ("mooney_share", "upturn"))
    stress, step = uniaxial(band.drawn(drawn), *shape), history.pull_time / HISTORY_STEPS
    at_rest = np.maximum(stress[:, -1], 1e-9)
    carried = overstress(stress, step) * np.exp(-history.pause / BRANCH_TIMES_S)
    rate = 10 ** parameters.column("log_flow_rate")
    return {
        "unrelaxed": carried / at_rest[:, None],
        "unflowed": flowing(stress, step, history.pause, rate) / at_rest,
    }


def launch(
    band: ClampedBand,
    setup: LaunchSetup,
    parameters: Parameters,
    draws: np.ndarray,
    *,
    max_force: float = np.inf,
    device: str = "cpu",
    workers: int = 1,
    refine: int = 1,
    double: bool = False,
) -> Launches:
    """Launch the projectile from draws (N, 2) with N parameters; one of each fits all.

    Args:
        max_force: A draw that takes more is a failed launch [N].
        workers: Threads, on the CPU; results do not depend on their number.
        refine: How many times finer the steps are than `setup.step`.
    """
    draws = np.atleast_2d(draws).astype(float)
    count = max(len(parameters), len(draws))
    parameters, draws = parameters.spread(count), np.broadcast_to(draws, (count, 2))
    distance = np.linalg.norm(draws, axis=1, keepdims=True)
    direction = np.column_stack([np.zeros(count), -draws / np.maximum(distance, 1e-9)])
    if setup.history is not None:
        before = band.drawn(np.array(setup.history.deepest))
        band = replace(band, stretched=np.maximum(band.stretched, before))
    slings = Slings.of(
        band, parameters, drawn_guess(band, draws), direction=direction,
        payload=setup.projectile_mass, **memory_of_pull(band, setup.history, parameters, draws),
    )  # fmt: skip
    options = Options(device, workers, launching=True, double=double)
    lanes = run(band, schedule_of(setup, refine), slings, options=options).lanes
    return limited(outcomes(band, setup, parameters, lanes, draws), max_force)


def limited(launches: Launches, max_force: float) -> Launches:
    """Launches by an arm that can hold no more than `max_force` [N]."""
    force = launches.hold_force
    over = force > max_force
    failure = [
        too_strong(force[i], max_force) if over[i] else reason
        for i, reason in enumerate(launches.failure)
    ]
    unknown = {
        field.name: np.where(over, np.nan, getattr(launches, field.name))
        for field in fields(launches)
        if field.name not in ("hold_force", "failure")
    }
    return replace(launches, **unknown, failure=failure)


def landing_gradient(
    land: Callable[[np.ndarray], np.ndarray], draws: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Landings (N, ...) [m] of draws (N, 2) [m], and how they change with the draw, (N, ..., 2).

    By central differences, all in one batch.

    Args:
        land: Landings (M, ...) [m] of draws (M, 2) [m], or more of each; NaN where one fails.
    """
    landing = land((draws[:, None] + CENTRAL_DIFFERENCES_M).reshape(-1, 2))
    landing = landing.reshape(len(draws), len(CENTRAL_DIFFERENCES_M), *landing.shape[1:])
    change = (landing[:, 1::2] - landing[:, 2::2]) / (2 * NUDGE_M)
    return landing[:, 0], np.moveaxis(change, 1, -1)


def outcomes(
    band: ClampedBand,
    setup: LaunchSetup,
    parameters: Parameters,
    lanes: np.ndarray,
    draws: np.ndarray,
) -> Launches:
    """Find the launches from draws (N, 2), by the slings' records (N,) of records.LANE."""
    outcome = np.round(lanes["outcome"])
    hold_force = np.linalg.norm(lanes["hold_force"], axis=1)
    hold_force[outcome > 0] = np.nan
    time, y, z, vy, vz = lanes["separation"].T
    vy, vz = np.sqrt(parameters.column("returned_share")) * np.stack([vy, vz])
    floor = -setup.fork_height
    landing = ballistic_landing(y, z, vy, vz, floor)

    failure = np.full(len(lanes), None, object)
    failure[~(landing > 0)] = SHORT
    plane = floor + setup.foot_height
    foot = np.where(z <= plane, y, ballistic_landing(y, z, vy, vz, plane))
    failure[(landing > 0) & (foot < 0)] = FOOT
    failure[outcome != Outcome.SEPARATED] = NEVER_LEFT
    failure[(lanes["lowest"] <= floor) | ((outcome == Outcome.SEPARATED) & (z <= floor))] = DRAGGED
    half = np.hypot(band.half_width, np.linalg.norm(draws, axis=1))
    failure[half <= band.rest_length / 2] = SLACK
    failure[~np.isfinite(hold_force)] = "the simulation did not converge"
    good = np.array([reason is None for reason in failure])

    def where_good(values: np.ndarray) -> np.ndarray:
        return np.where(good, values, np.nan)

    return Launches(
        landing_y=where_good(landing),
        speed=where_good(np.hypot(vy, vz)),
        angle=where_good(np.arctan2(vz, vy)),
        hold_force=hold_force,
        separation_time=where_good(time),
        separation_y=where_good(y),
        separation_z=where_good(z),
        failure=failure.tolist(),
    )
