"""`engine: physx`: the recorded interaction in PhysX, as the search's evaluator asks for it.

The paper's settings. The hand holds a section of the band and lets go of it at once: an attachment,
not pads, so that friction has no effect; the damping scale has no slot in today's PhysX.
"""

from __future__ import annotations

import atexit
from functools import cache

import numpy as np

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.export.mesh import Tube
from pipeline.simulator.interaction import Rollouts
from pipeline.simulator.model import GRAVITY, ClampedBand
from pipeline.simulator.parameters import Parameters
from pipeline.simulator.rubber import NEO_HOOKEAN
from validation.engines.checks import SAME_MESH
from validation.engines.physx.bands import Engine
from validation.engines.physx.study import MARK, motions, phases

RATE, ITERATIONS = MARK, 64  # the paper's steps a second, and the solver's iterations
SPACE = 10.0  # m: a band that leaves it has burst
BURST = "the band burst in PhysX"


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
    if sling.law != NEO_HOOKEAN:
        raise UserError(f"engine: physx has no law {sling.law}; set law: {NEO_HOOKEAN}")
    tube, thetas = Tube.of(sling, **SAME_MESH), parameters.theta
    course = phases(tube, episode, RATE)
    courses = _engine().simulate(tube, thetas, course, rate=RATE, iterations=ITERATIONS)
    return rollouts(sling, tube, episode, thetas, courses)


def rollouts(sling, tube: Tube, episode, thetas: np.ndarray, courses) -> Rollouts:
    """Forces and centre lines of the courses that `study.phases` makes, on the episode's clock.

    Before the grasp the band hangs and nothing pulls at the hand; after the release, neither.
    """
    with np.errstate(all="ignore"):  # burst bands
        bands = motions(tube, thetas, courses)
    held, free = (len(course.positions) for course in courses[1:])
    marks = episode.release_time + np.arange(1 - held, free + 1) / RATE
    times = [episode.grasp_time - 1 / RATE, *marks[:held]]
    times += [episode.release_time + sling.finger_opening_time, marks[-1]]
    section = tube.mass.reshape(tube.rest.shape[:2])[tube.middle].sum()
    force, lines, failure = [], [], []
    for band in bands:
        sound = np.isfinite(band.lines).all() and np.abs(band.lines).max() < SPACE
        pull = (band.force if sound else np.nan * band.force) - [0, 0, section * GRAVITY]
        force.append(np.concatenate([np.zeros((1, 3)), pull, np.zeros((2, 3))]))
        lines.append(_at(episode.cloud_time, marks, _between(sling.arc, tube.arc, band.lines)))
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
