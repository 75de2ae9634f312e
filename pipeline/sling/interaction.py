"""The recorded interaction in simulation: hang, grasp, follow the hand, let go, swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.sling.initial import hanging_guess
from pipeline.sling.material import material
from pipeline.sling.model import Sling
from pipeline.sling.solver import (
    FAILURE,
    FREE,
    HELD,
    ITERATIONS,
    LANE_STATE,
    NOT_CONVERGED,
    OPENING,
    RELAX_STEPS,
    SLIPPED,
    Schedule,
    relaxation,
    run,
    steps,
)

GRASP_BLEND = 0.5  # s in which the held node moves from where the band hung to the hand's path


@dataclass(frozen=True)
class Rollouts:
    """N simulated interactions on the episode's clock, frame O.

    Attributes:
        times: Ends of the steps [s], shape (S,); irregular.
        force: Of the band on the gripper [N], shape (N, S, 3).
        cloud_time: The camera's stamps [s], shape (K,).
        center_line: Nodes of the band at those stamps [m], shape (N, K, sections, 3), float32.
        failure: None, or why this rollout counts for nothing, length N.
        iterations: Newton steps it took, shape (N,); those of a SIMD vector or a warp together.
    """

    times: np.ndarray
    force: np.ndarray
    cloud_time: np.ndarray
    center_line: np.ndarray
    failure: list[str | None]
    iterations: np.ndarray | None = None


def schedule_of(sling: Sling, episode: Episode, refine: int = 1) -> Schedule:
    """Steps of one episode; the same for every theta.

    At the episode's release time the band begins to slip between the opening fingers: the force
    shows that moment, whatever the friction. From then on the friction that is left falls as the
    pads' normal force does, which is gone after `finger_opening_time`.
    """
    size = sling.steps
    release = episode.release_time
    clear = release + sling.finger_opening_time
    end = max(episode.time[-1], *episode.cloud_time[-1:]) + 1e-3
    if release <= episode.grasp_time:
        raise UserError(
            f"episode of {episode.band}: released at {release:g} s, grasped at"
            f" {episode.grasp_time:g} s; a recording needs a pull between them"
        )

    def grid(first: float, last: float, step: float) -> np.ndarray:
        return np.linspace(
            first, last, max(int(np.ceil((last - first) / step * refine - 1e-9)), 1) + 1
        )

    recoil_end = max(min(clear + size.recoil_time, end), clear + size.recoil_step)
    relax = relaxation(FREE)
    relax[:, 11] = episode.grasp_time
    held = steps(grid(episode.grasp_time, release, size.grip_step), 1, hold=HELD)
    opening_times = grid(release, clear, size.recoil_step)
    opening = steps(opening_times, held[-1, 0], hold=OPENING, order=2)
    recoil = steps(grid(clear, recoil_end, size.recoil_step), opening[-1, 0], hold=FREE, order=2)
    swing = np.zeros((0, 13))
    if end > recoil_end:
        swing = steps(grid(recoil_end, end, size.swing_step), recoil[-1, 0], hold=FREE, order=2)
    held[:, 9] = sling.grip_force
    opening[:, 9] = sling.grip_force * (opening[:, 11] - release) / sling.finger_opening_time
    table = np.vstack([relax, held, opening, recoil, swing])

    hand = CubicSpline(episode.time, episode.position, axis=0)
    inside = np.clip(table[:, 11], episode.time[0], episode.time[-1])
    table[:, 6:9] = hand(inside)
    part = np.clip((table[:, 11] - episode.grasp_time) / GRASP_BLEND, 0, 1)
    table[:, 10] = 1 - part**3 * (10 - 15 * part + 6 * part**2)
    return Schedule(table, first_free=RELAX_STEPS + len(held) + len(opening))


def interact(
    sling: Sling,
    episode: Episode,
    thetas: np.ndarray,
    *,
    device: str = "cpu",
    workers: int = 1,
    fetch: bool = True,
    refine: int = 1,
    double: bool = False,
) -> Rollouts:
    """Simulate the episode's interaction with physical thetas (N, 5).

    Args:
        workers: Threads, on the CPU; results do not depend on their number.
        fetch: Copy forces and centre lines from a GPU; else they stay there as Warp arrays.
        refine: How many times finer the steps are than `sling` says.
    """
    thetas = np.atleast_2d(thetas)
    schedule = schedule_of(sling, episode, refine)
    times = schedule.times
    frame_steps = np.searchsorted(times, episode.cloud_time).clip(RELAX_STEPS - 1, len(times) - 1)
    before = times[frame_steps] - schedule.table[frame_steps, 0]
    weights = np.clip((episode.cloud_time - before) / schedule.table[frame_steps, 0], 0, 1)
    weights[frame_steps < RELAX_STEPS] = 1.0
    result = run(
        sling,
        schedule,
        material(sling, thetas),
        hanging_guess(sling),
        np.zeros((len(thetas), LANE_STATE)),
        frame_steps=frame_steps,
        frame_weights=weights,
        device=device,
        fetch=fetch,
        workers=workers,
        double=double,
    )
    reasons = {
        0: None,
        NOT_CONVERGED: "the simulation did not converge",
        SLIPPED: "the band slipped out of the fingers",
    }
    return Rollouts(
        times=times[RELAX_STEPS - 1 :],
        force=result.output[:, RELAX_STEPS - 1 :, :3],
        cloud_time=episode.cloud_time,
        center_line=result.frames,
        failure=[reasons[int(round(code))] for code in result.lane_state[:, FAILURE]],
        iterations=result.lane_state[:, ITERATIONS].astype(int),
    )
