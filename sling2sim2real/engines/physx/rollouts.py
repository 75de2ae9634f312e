"""`engine: physx`: the recorded interaction in PhysX, as the search's evaluator asks for it.

The paper's settings. The hand holds a section of the band and lets go of it at once: an attachment,
not pads, so that friction has no effect; the damping scale has no slot in today's PhysX.
"""

from __future__ import annotations

import atexit
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.engines.physx.bands import BURST, LARGEST_PLACE_M, Engine
from sling2sim2real.engines.physx.law import force_on
from sling2sim2real.engines.physx.scene import Drive
from sling2sim2real.episode.episode import Episode
from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import EDGES, GRADING, STEPS_PER_S
from sling2sim2real.simulator.interaction import GRASP_BLEND_S, Rollouts
from sling2sim2real.simulator.model import GRAVITY, ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import COROTATED, NEO_HOOKEAN

SETTLE, LEAD = 1.0, 0.3  # s of hanging before the grasp, of them to lead the ends into the clamps


@cache
def _engine() -> Engine:
    """One for all batches of this process."""
    engine = Engine()
    atexit.register(engine.__exit__)
    return engine


def simulate(
    sling: ClampedBand, *, episode: Episode, parameters: Parameters, device: str
) -> Rollouts:
    """Rollouts of N parameters on PhysX's own device, whatever `device` says.

    Raises UserError: as `Engine`, or for a law that PhysX does not have.
    """
    if sling.law not in (NEO_HOOKEAN, COROTATED):  # five parameters each, which PhysX has too
        raise UserError(f"engine: physx has no law {sling.law}; set law: {COROTATED}")
    tube, thetas = Tube.of(sling, EDGES, GRADING), parameters.theta
    _, held, free = _engine().simulate(tube, thetas, phases(tube, episode))
    return rollouts(sling, tube, episode, thetas, held, free)


def phases(tube: Tube, episode: Episode) -> list[Drive]:
    """Hang, hold and fly free."""
    ends = tube.clamped.reshape(-1, 3)[tube.ends]
    hanging, held, free = (
        np.arange(1, round(duration * STEPS_PER_S) + 1) / STEPS_PER_S
        for duration in (
            SETTLE,
            episode.release_time - episode.grasp_time,
            episode.time[-1] - episode.release_time,
        )
    )
    times = episode.release_time - held[-1] + held
    path = CubicSpline(episode.time, episode.position)(times)
    led = path[:, None] + tube.rest[tube.middle] * [0.0, 1.0, 1.0]
    return [
        Drive(tube.ends, ends[None], 0.5 + 0.5 * np.cos(np.pi * np.minimum(hanging / LEAD, 1))),
        Drive(
            np.concatenate([tube.ends, tube.hand]),
            np.concatenate([np.tile(ends, (len(held), 1, 1)), led], axis=1),
            1 - minimum_jerk(held / GRASP_BLEND_S),
            keep=True,
        ),
        Drive(tube.ends, ends[None], np.zeros(len(free)), keep=True),
    ]


def rollouts(
    sling: ClampedBand,
    tube: Tube,
    episode: Episode,
    thetas: np.ndarray,
    held: np.ndarray,
    free: np.ndarray,
) -> Rollouts:
    """Forces and centre lines on the episode's clock.

    Before the grasp the band hangs and nothing pulls at the hand; after the release, neither.

    Args:
        held, free: Places of the nodes after each step in the hand and after the release [m],
            shape (steps, N, sections, V, 3).
    """
    with np.errstate(all="ignore"):  # burst bands
        forces = force_on(tube, [tube.middle], held, thetas[:, 0], thetas[:, 1])
    center_lines = np.concatenate([held, free])[:, :, 1:-1, 0]
    marks = episode.release_time + np.arange(1 - len(held), len(free) + 1) / STEPS_PER_S
    times = [episode.grasp_time - 1 / STEPS_PER_S, *marks[: len(held)]]
    times += [episode.release_time + sling.finger_opening_time, marks[-1]]
    section = tube.mass[tube.hand].sum()
    force, lines, failure = [], [], []
    for pull, line in zip(forces.swapaxes(0, 1), center_lines.swapaxes(0, 1), strict=True):
        sound = np.isfinite(line).all() and np.abs(line).max() < LARGEST_PLACE_M
        on_hand = (pull if sound else np.nan * pull) - [0, 0, section * GRAVITY]
        force.append(np.concatenate([np.zeros((1, 3)), on_hand, np.zeros((2, 3))]))
        lines.append(_at(episode.cloud_time, marks, _between(sling.arc, tube.arc, line)))
        failure.append(None if sound else BURST)
    line = np.array(lines, np.float32)
    return Rollouts(np.array(times), np.array(force), episode.cloud_time, line, failure)


def _between(arc: np.ndarray, places: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Centre lines (S, L, 3), given at places (L,) along the band, at arc (M,)."""
    return _at(arc, places, lines.swapaxes(0, 1)).swapaxes(0, 1)


def _at(wanted: np.ndarray, places: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (K, ...) at places (K,), interpolated along the first axis; beyond, the outermost."""
    after = np.searchsorted(places, wanted).clip(1, len(places) - 1)
    part = ((wanted - places[after - 1]) / (places[after] - places[after - 1])).clip(0, 1)
    part = part.reshape(-1, *[1] * (values.ndim - 1))
    return (1 - part) * values[after - 1] + part * values[after]
