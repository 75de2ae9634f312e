"""Launches: the projectile in the pouch, from a static draw to the floor."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from pipeline.sling.initial import drawn_guess
from pipeline.sling.material import material
from pipeline.sling.model import GRAVITY, Sling
from pipeline.sling.solver import (
    DIRECTION,
    FAILURE,
    FREE,
    HELD_FORCE,
    LANE_STATE,
    LEFT,
    PAYLOAD,
    POUCH,
    RELAX_STEPS,
    SEPARATION,
    Schedule,
    relaxation,
    run,
    steps,
)

SHARE = 1024  # launches: a device more for fewer would only cost its start


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


def ballistic_landing(y, z, vy, vz, floor: float):
    """Where a free projectile from (y, z) with (vy, vz) meets z = floor, without drag."""
    flight = (vz + np.sqrt(vz**2 + 2 * GRAVITY * np.maximum(z - floor, 0))) / GRAVITY
    return y + vy * flight


def schedule_of(sling: Sling, refine: int = 1) -> Schedule:
    """Relax at the draw, then recoil in second-order steps."""
    relax = relaxation(POUCH)
    relax[:, 10] = 1.0
    h = sling.steps.launch_step / refine
    count = int(round(sling.steps.launch_time / h))
    first = steps([0.0, h], h, hold=FREE)
    rest = steps(h * np.arange(1, count + 1), h, hold=FREE, order=2)
    return Schedule(np.vstack([relax, first, rest]), first_free=RELAX_STEPS)


def launch(
    sling: Sling,
    thetas: np.ndarray,
    draws: np.ndarray,
    *,
    max_force: float = np.inf,
    device: str | Sequence[str] = "cpu",
    workers: int = 1,
    refine: int = 1,
    double: bool = False,
) -> Launches:
    """Launch the projectile from draws (N, 2) with physical thetas (N, 5); one of each fits all.

    Args:
        max_force: A draw that takes more is a failed launch [N].
        device: Or several of one kind, which share a large batch evenly.
        workers: Threads, on the CPU; results depend on them as little as on the devices' number.
        refine: How many times finer the steps are than `sling.launch_step`.
    """
    thetas, draws = np.atleast_2d(thetas).astype(float), np.atleast_2d(draws).astype(float)
    count = max(len(thetas), len(draws))
    thetas = np.broadcast_to(thetas, (count, 5))
    draws = np.broadcast_to(draws, (count, 2))
    lane_state = np.zeros((count, LANE_STATE))
    distance = np.linalg.norm(draws, axis=1, keepdims=True)
    lane_state[:, DIRECTION][:, 1:] = -draws / np.maximum(distance, 1e-9)
    lane_state[:, PAYLOAD] = sling.projectile_mass
    schedule = schedule_of(sling, refine)
    begin = material(sling, thetas), drawn_guess(sling, draws), lane_state

    def launched(place: str, share: np.ndarray) -> np.ndarray:
        rows = (values[share] for values in begin)
        options = {"launching": True, "device": place, "workers": workers, "double": double}
        return run(sling, schedule, *rows, **options).lane_state

    devices = [device] if isinstance(device, str) else device[: max(count // SHARE, 1)]
    shares = np.array_split(np.arange(count), len(devices))
    with ThreadPoolExecutor(len(devices)) as pool:
        lane_state = np.concatenate(list(pool.map(launched, devices, shares)))
    hold_force = np.linalg.norm(lane_state[:, HELD_FORCE].astype(float), axis=1)
    code = np.round(lane_state[:, FAILURE])
    hold_force[code > 0] = np.nan
    time, y, z, vy, vz = lane_state[:, SEPARATION].astype(float).T
    landing = ballistic_landing(y, z, vy, vz, -sling.fork_height)
    failure: list[str | None] = []
    for i in range(count):
        if not np.isfinite(hold_force[i]):
            failure.append("the simulation did not converge")
        elif hold_force[i] > max_force:
            failure.append(f"holding takes {hold_force[i]:.1f} N, more than {max_force:g} N")
        elif code[i] != LEFT:
            failure.append("the projectile never left the pouch")
        elif not landing[i] > 0:
            failure.append("the projectile fell short of the fork")
        else:
            failure.append(None)
    good = np.array([reason is None for reason in failure])
    speed, angle = np.hypot(vy, vz), np.arctan2(vz, vy)
    known = [np.where(good, v, np.nan) for v in (landing, speed, angle, time, y, z)]
    return Launches(known[0], known[1], known[2], hold_force, *known[3:], failure=failure)
