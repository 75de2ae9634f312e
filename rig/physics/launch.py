"""Launch trials: the same band drawn, paused and let go with the projectile in a massless pouch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from rig.physics.compiled import compiled
from rig.physics.draw import sampled
from rig.physics.integration import integrated
from rig.physics.scene import ROD
from rig.physics.string import GRAVITY, ElasticString
from rig.physics.world import bent_at, pulled, string_of
from sling2sim2real.base.failures import DRAGGED, FOOT, NEVER_LEFT, SHORT, SLACK, too_strong
from sling2sim2real.base.target import TARGET_AREA

if TYPE_CHECKING:
    from pipeline.params import Params

PATIENCE = 0.5  # s within which the projectile leaves the pouch, if it ever does
FLIGHT = 20.0  # s, more than any flight takes
SEEN = 501  # moments at which the pouch may touch the floor
POINTS = 40  # of a flight, evenly in time


@dataclass(frozen=True)
class Trial:
    """One launch, SI units, frame O; NaN where there is nothing to tell.

    Attributes:
        landing_y: Where the projectile meets the floor, also beyond the area.
        failure: None, or why there is no landing.
        hold_force: Of the drawn band on the hand.
        speed, angle: Of the projectile as it leaves the pouch [m/s, rad above the horizon].
        flight: Its way (y, z) [m] from the pouch to the floor, or to the fork if it hits that,
            shape (K, 2); None where it did not fly.
    """

    landing_y: float
    failure: str | None
    hold_force: float
    speed: float = float("nan")
    angle: float = float("nan")
    flight: np.ndarray | None = field(default=None, compare=False)


def launch(
    band_name: str, params: Params, draw: Sequence[float] | np.ndarray, number: int | None
) -> Trial:
    """Launch from the commanded draw (y, z).

    Args:
        number: Of the trial, by which (with `trials.seed`) go the actuation error
            (`trials.actuation_error`, normal in y and z) and the kick of the opening fingers
            (`rig.release_jitter`): equal numbers give every method the same ones. None: neither.
    """
    params = sampled(params, band_name, launching=True)
    aim, kick = np.array([0.0, *draw]), np.zeros(3)
    if number is not None:
        rng = np.random.default_rng([params.rig.seed, 1_000_000 * params.trials.seed + number])
        aim[1:] += rng.normal(0, params.trials.actuation_error, 2)
        kick[1:] = rng.normal(0, params.rig.release_jitter, 2)
    return launch_from(string_of(params, band_name), params, aim, kick)


def launch_from(
    string: ElasticString, params: Params, aim: np.ndarray, kick: np.ndarray | None = None
) -> Trial:
    """Launch by an arm sent to exactly `aim` (3,), let go with the velocity `kick` (3,).

    The arm rests where its stiffness (`rig.arm`) holds the drawn band.
    """
    tolerance, mass = params.rig.tolerance, params.setup.projectile_mass
    taut = string.length / 2
    if np.linalg.norm(aim - string.clamps[0]) <= taut:
        return Trial(float("nan"), SLACK, 0.0)
    requested = params.launch
    *_, relaxed, memory = pulled(string, aim, requested.pull_time, requested.pause, again=True)
    give, memory_ratios = 1 / params.rig.arm.stiffness, memory[-1] / relaxed[-1]
    y = string.at_rest(bent_at(string, aim), tolerance, held=True, give=give, memory=memory_ratios)
    hold_force = float(np.linalg.norm(string.at_middle(y)))
    limit = params.setup.max_force
    if hold_force > limit:
        return Trial(float("nan"), too_strong(hold_force, limit), hold_force)

    loaded = replace(string, payload=mass)
    y[string.middle, 3:6] = 0.0 if kick is None else kick
    heading = -aim / np.linalg.norm(aim)

    def push(time: float, y: np.ndarray) -> float:
        """Force of the pouch on the projectile along the launch [N]."""
        acceleration = loaded.at_middle(y) / loaded.masses[loaded.middle]
        return float(mass * (acceleration - GRAVITY) @ heading)

    times, states = loaded.integrate(y, np.linspace(0.0, PATIENCE, SEEN), tolerance, event=push)
    floor = -params.setup.fork_height
    if states[:, loaded.middle, 2].min() <= floor:
        return Trial(float("nan"), DRAGGED, hold_force)
    if times[-1] >= PATIENCE:
        return Trial(float("nan"), NEVER_LEFT, hold_force)
    position, velocity = states[-1, loaded.middle, 1:3], states[-1, loaded.middle, 4:6]
    drag = params.rig.projectile_drag / mass
    way = flight(position, velocity, floor, drag)
    landing = float(way[-1, 0])
    speed, angle = float(np.hypot(*velocity)), float(np.arctan2(velocity[1], velocity[0]))
    low, high = TARGET_AREA
    reason = None
    if not landing > 0:
        landing, reason = float("nan"), SHORT
    elif fly(position, velocity, floor + ROD, drag) < 0:
        landing, reason = float("nan"), FOOT
        way = way[way[:, 0] < 0]
    elif not low <= landing <= high:
        where = "too short" if landing < low else "beyond the area"
        reason = f"{where}: lands at {landing:.3f} m, not within {low:g} to {high:g} m"
    return Trial(landing, reason, hold_force, speed, angle, way)


def fly(position: np.ndarray, velocity: np.ndarray, floor: float, drag: float) -> float:
    """Where a projectile from `position` (y, z) with `velocity` meets z = floor: there, if below.

    Args:
        drag: Deceleration per squared speed [1/m].
    """
    return float(flight(position, velocity, floor, drag)[-1, 0])


def flight(position: np.ndarray, velocity: np.ndarray, floor: float, drag: float) -> np.ndarray:
    """Its way there (y, z) [m], evenly in time, shape (POINTS, 2); where it is, if below."""
    if position[1] <= floor:
        return position[None]

    state, data = np.concatenate([position, velocity]), (drag, GRAVITY[2], floor)
    common = {"data": data, "rtol": 1e-9, "atol": 1e-9, "event": _height, "method": "Adams"}
    times, _ = integrated(_flying, state, np.linspace(0, FLIGHT, 3), **common)
    return integrated(_flying, state, np.linspace(0, times[-1], POINTS), **common)[1][:, :2]


@compiled
def _flying(
    time: float, state: np.ndarray, out: np.ndarray, data: tuple[float, float, float]
) -> None:
    speed = np.hypot(state[2], state[3])
    out[:2] = state[2:]
    out[2], out[3] = -data[0] * speed * state[2], data[1] - data[0] * speed * state[3]


@compiled
def _height(
    time: float, state: np.ndarray, out: np.ndarray, data: tuple[float, float, float]
) -> None:
    out[0] = state[1] - data[2]
