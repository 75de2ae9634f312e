"""The recorded interaction in simulation: hang, grasp, follow the hand, let go, swing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.simulator.initial import hanging_guess
from sling2sim2real.simulator.model import ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip, Outcome
from sling2sim2real.simulator.schedule import RELAX_STEPS, Schedule, relaxation, steps
from sling2sim2real.simulator.solver import Frames, Options, Slings, run

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

    from sling2sim2real.episode.episode import Episode

FAILURES = {
    Outcome.GOING_ON: None,
    Outcome.NOT_CONVERGED: "the simulation did not converge",
    Outcome.SLIPPED: "the band slipped out of the fingers",
}
FRICTION = 0.8  # of the pads, whose opening time the fall of the force tells
# Of the steps while the hand holds.
LARGEST_BOW_M, BEND_GRID_S, BEND_WINDOW_S = 5e-6, 1e-3, 0.03
GRASP_BLEND_S = 0.5  # s in which the held node moves from where the band hung to the hand's path


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


def with_recorded_pads(
    sling: ClampedBand, episode: Episode, friction: float = FRICTION
) -> ClampedBand:
    """The band in pads that open in the time in which the force falls as fast as recorded.

    From the slip on friction falls with the pads' force, which is gone after the opening time: the
    held force is gone sooner, by its share of the friction of closed pads. An episode that does
    not say how fast its force fell leaves the lab's own time.

    Args:
        friction: That the pads are taken to have while the force falls.
    """
    fall = episode.metadata.get("preprocessing", {}).get("release_fall")
    if not fall:
        return sling
    last = np.flatnonzero(episode.time < episode.release_time)[-20:]
    held = np.linalg.norm(episode.force[last], axis=1).max()
    opening = np.clip(fall * 2 * friction * sling.grip_force / held, 5e-4, 0.05)
    return replace(sling, finger_opening_time=float(opening))


def schedule_of(sling: ClampedBand, episode: Episode, refine: int = 1) -> Schedule:
    """Steps of one episode; the same for every theta.

    At the episode's release time the band begins to slip between the opening fingers: the force
    shows that moment, whatever the friction. From then on the friction that is left falls as the
    pads' normal force does, which is gone after `finger_opening_time`.
    """
    from scipy.interpolate import CubicSpline  # which takes a third of a second

    size, release = sling.steps, episode.release_time
    if release <= episode.grasp_time:
        raise UserError(
            f"episode of {episode.band}: released at {release:g} s, grasped at"
            f" {episode.grasp_time:g} s; a recording needs a pull between them"
        )
    clear = release + sling.finger_opening_time
    end = max(episode.time[-1], *episode.cloud_time[-1:]) + 1e-3
    recoil_end = max(min(clear + size.recoil_time, end), clear + size.recoil_step)
    phases = (  # until when, in steps of what size
        (clear, size.recoil_step, Grip.OPENING),
        (recoil_end, size.recoil_step, Grip.FREE),
        (end, size.swing_step, Grip.FREE),
    )
    hand = CubicSpline(episode.time, episode.position, axis=0)
    held = _held_times(hand, episode, size, refine)
    rows = relaxation(Grip.FREE)
    rows["time"] = episode.grasp_time
    rows = np.concatenate([rows, steps(held, 1.0, grip=Grip.HELD, order=2)])
    begin = release
    for until, step, grip in phases:
        if until > begin:
            count = max(int(np.ceil((until - begin) / step * refine - 1e-9)), 1)
            times = np.linspace(begin, until, count + 1)
            rows = np.concatenate([rows, steps(times, rows["h"][-1], grip=grip, order=2)])
            begin = until
    _lead(rows, hand, sling, episode)
    return Schedule(rows, first_free=RELAX_STEPS + int(np.count_nonzero(rows["grip"])))


def _held_times(hand: CubicSpline, episode: Episode, size, refine: int) -> np.ndarray:
    """Ends of the steps from grasp to release [s]: as long as the hand goes nearly straight.

    A step of h bows from its chord by h^2 |a| / 8, at most LARGEST_BOW_M, and a band that the hand
    holds follows it. Between `grip_step` and `hold_step`.
    """
    from scipy.ndimage import maximum_filter1d

    time = np.arange(episode.grasp_time, episode.release_time, BEND_GRID_S)
    bend = np.linalg.norm(hand(_within(time, episode), 2), axis=1)
    bend = maximum_filter1d(bend, 2 * round(BEND_WINDOW_S / BEND_GRID_S) + 1)
    longest = np.sqrt(8 * LARGEST_BOW_M / np.maximum(bend, 1e-9)).clip(
        size.grip_step, size.hold_step
    )
    longest[time < episode.grasp_time + GRASP_BLEND_S] = size.grip_step
    done = np.append(0.0, np.cumsum(np.diff(time, append=episode.release_time) / longest))
    count = max(int(np.ceil(done[-1] * refine - 1e-9)), 1)
    return np.interp(
        np.linspace(0, done[-1], count + 1), done, np.append(time, episode.release_time)
    )


def _within(time: np.ndarray, episode: Episode) -> np.ndarray:
    return np.clip(time, episode.time[0], episode.time[-1])


def _lead(rows: np.ndarray, hand: CubicSpline, sling: ClampedBand, episode: Episode) -> None:
    """Say of steps where the hand is, and with what force its pads hold the band."""
    time, opening = rows["time"], rows["grip"] == Grip.OPENING
    rows["grip_force"][rows["grip"] == Grip.HELD] = sling.grip_force
    since = time[opening] - episode.release_time
    rows["grip_force"][opening] = sling.grip_force * since / sling.finger_opening_time
    rows["target"] = hand(_within(time, episode))
    rows["blend"] = blend(time, episode)


def blend(time: np.ndarray, episode: Episode) -> np.ndarray:
    """What share is left, at times (T,), of the way from the grasp to the hand's path."""
    return 1 - minimum_jerk((time - episode.grasp_time) / GRASP_BLEND_S)


def interact(
    band: ClampedBand,
    episode: Episode,
    parameters: Parameters,
    *,
    rigidity: np.ndarray | None = None,
    device: str = "cpu",
    workers: int = 1,
    fetch: bool = True,
    refine: int = 1,
    double: bool = False,
    until: float = np.inf,
) -> Rollouts:
    """Simulate the episode's interaction with N parameters.

    Args:
        rigidity: Flexural, of each sample [N m^2], shape (N,); None: the band's.
        workers: Threads, on the CPU; results do not depend on their number.
        fetch: Copy forces and centre lines from a GPU; else they stay there as Warp arrays.
        refine: How many times finer the steps are than `band` says.
        until: Nothing is simulated after this time [s], if the band is free then: pictures end
            there, and what is left of the force is 0, as it is on the host. All else is the same
            to the bit.
    """
    schedule = schedule_of(band, episode, refine)
    times, stamps = schedule.steps["time"], episode.cloud_time
    last = max(np.searchsorted(times, until) + 1, schedule.first_free)
    schedule = replace(schedule, steps=schedule.steps[:last])
    stamps = stamps[stamps <= max(until, schedule.steps["time"][-1])]
    done = run(
        band,
        schedule,
        Slings.of(band, parameters, hanging_guess(band), rigidity),
        _frames(schedule, stamps),
        Options(device, workers, fetch=fetch, double=double),
    )
    force = done.output[:, RELAX_STEPS - 1 :, :3]
    if unfelt := len(times) - len(schedule.steps):
        force = np.pad(force, ((0, 0), (0, unfelt), (0, 0)))
    return Rollouts(
        times=times[RELAX_STEPS - 1 :],
        force=force,
        cloud_time=stamps,
        center_line=done.frames,
        failure=[FAILURES[Outcome(round(code))] for code in done.lanes["outcome"]],
        iterations=done.lanes["iterations"].astype(int),
    )


def _frames(schedule: Schedule, stamps: np.ndarray) -> Frames:
    """The camera's, at stamps (K,); those before the grasp show the band at rest."""
    ends, lengths = schedule.steps["time"], schedule.steps["h"]
    within = np.searchsorted(ends, stamps).clip(RELAX_STEPS - 1, len(ends) - 1)
    before = ends[within] - lengths[within]
    weights = np.clip((stamps - before) / lengths[within], 0, 1)
    weights[within < RELAX_STEPS] = 1.0
    return Frames(within, weights)
