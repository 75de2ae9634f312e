"""What the checks have in common: a straight band, steps of it with every state, its rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sling2sim2real.simulator.initial import fixed_frames, sections_of
from sling2sim2real.simulator.model import ClampedBand, LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import Grip, Mode
from sling2sim2real.simulator.schedule import Schedule, statics, steps
from sling2sim2real.simulator.solver import Frames, Options, Slings, run
from validation.simulator.finding import Bench

SIZES = {"mass": 0.023, "diameter": 0.010, "rest_length": 0.52}  # for which the limits were set
TIGHT = {"double": True, "tolerance": 1e-12}  # the kernel as exact as it gets


@dataclass(frozen=True)
class Trajectories:
    """N bands through a schedule.

    Attributes:
        start: Shape (N, L, 9).
        x, v: States and rates at the end of each step, shape (N, S, L, 9).
        at: States predicted for each step, shape (N, S, L, 9).
        force: Of the band on the hand, shape (N, S, 3).
        failed: Whether a band did not converge or slipped, shape (N,).
    """

    table: np.ndarray
    start: np.ndarray
    x: np.ndarray
    v: np.ndarray
    at: np.ndarray
    force: np.ndarray
    failed: np.ndarray


def band_of(bench: Bench) -> ClampedBand:
    """The proofs' own band as a solid rod of the default resolution, without air."""
    params = bench.params
    band = next(iter(params.bands.values())).model_copy(update=SIZES)
    sling = ClampedBand.of(band, params.setup, params.sling)
    return replace(sling, air_density=0.0)


def setup_of(bench: Bench, **changes) -> LaunchSetup:
    """How it is launched: by an arm that does not give way, without a history."""
    setup = LaunchSetup.of(bench.params.setup, bench.params.sling)
    return replace(setup, arm_stiffness=None, **changes)


def straight(sling: ClampedBand, length: float, **changes) -> ClampedBand:
    """A band whose clamps are `length` apart and in line."""
    return replace(
        sling, half_width=length / 2, clamp_direction=np.array([1.0, 0.0, 0.0]), **changes
    )


def straight_guess(sling: ClampedBand, first_half: float | None = None) -> np.ndarray:
    """Sections (L, 9) of a straight band, its first half stretched to `first_half` [m]."""
    middle = 0.0 if first_half is None else first_half - sling.half_width
    place = [0.0, sling.arc[sling.middle], sling.rest_length]
    nodes = np.zeros((sling.sections, 3))
    nodes[:, 0] = np.interp(sling.arc, place, [-sling.half_width, middle, sling.half_width])
    return sections_of(sling, nodes)


def launched(h: float, count: int, order: int = 2) -> np.ndarray:
    """`count` free steps of `h` from rest; second order begins with one of backward Euler."""
    rest = steps(h * np.arange(1, count + 1), h, grip=Grip.FREE, order=order)
    return np.concatenate([steps([0.0, h], h, grip=Grip.FREE), rest])


def settling(grip: Grip = Grip.FREE, target=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Steps that bring a guess to rest whatever its own times are, the held node at `target`."""
    result = statics(grip)
    result["target"] = target
    result["grip_force"] = 1e9  # pads that hold anything
    return result


def move(
    bench: Bench, sling: ClampedBand, parameters: Parameters, table: np.ndarray,
    start: np.ndarray, *,
    payload: float = 0.0, unrelaxed: float = 0.0, **options,
) -> Trajectories:  # fmt: skip
    """Step N parameters from `start` (N, L, 9) or (L, 9), at rest, through steps (S,).

    The law's branches begin with a share `unrelaxed` of the stress at rest; other options are those
    of the solver.
    """
    start = np.array(start, float)
    start[..., -1, 3:] = fixed_frames(sling)[1].ravel()  # the last clamp's, whatever was before
    count = len(table)
    done = run(
        sling,
        Schedule(table, first_free=count),
        Slings.of(
            sling, parameters, start, payload=payload, unrelaxed=unrelaxed, unflowed=unrelaxed
        ),
        Frames(np.arange(count), np.ones(count), width=9),
        Options(bench.device, bench.workers, **options),
    )
    x = done.frames.astype(float)
    start = np.broadcast_to(start, (len(parameters), *x.shape[2:]))
    return Trajectories(
        table,
        start,
        x,
        *rates(sling.middle, table, start, x),
        force=done.output[:, :, :3].astype(float),
        failed=done.lanes["outcome"] > 0,
    )


def held_straight(
    bench: Bench, sling: ClampedBand, stretch: float, parameters: Parameters, **options
) -> tuple[ClampedBand, Trajectories]:
    """A straight band that comes to rest with its first half stretched, the other at its length.

    The fingers hold the middle, so that the hand feels the first half alone.
    """
    half = sling.rest_length / 2
    sling = straight(sling, (stretch + 1) * half)
    table = settling(Grip.HELD, (stretch * half - sling.half_width, 0.0, 0.0))
    start = straight_guess(sling, stretch * half)
    return sling, move(bench, sling, parameters, table, start, gravity=0.0, **options)


def rates(
    middle: int, table: np.ndarray, start: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rates and predicted states (N, S, L, 9) of recorded states, from the steps' formula."""
    v, at = np.empty_like(x), np.empty_like(x)
    x1 = x2 = start
    v1 = np.zeros_like(start)
    for k, step in enumerate(table):
        h, past, beta = (step[name] for name in ("h", "past", "beta"))
        relax = step["mode"] == Mode.RELAX
        at[:, k] = x1 + h * v1
        if step["grip"] in (Grip.HELD, Grip.POUCH):  # the hand leads it
            at[:, k, middle, :3] = x[:, k, middle, :3]
        v[:, k] = 0.0 if relax else (x[:, k] - x1 - past * (x1 - x2)) / (beta * h)
        x1, x2, v1 = x[:, k], (x[:, k] if relax else x1), v[:, k]
    return v, at


def rest(
    bench: Bench, sling: ClampedBand, parameters: Parameters, start, *, table=None, **options
) -> np.ndarray:
    """Sections (L, 9) of one band at rest."""
    table = settling() if table is None else table
    motion = move(bench, sling, parameters, table, start, **options)
    return np.full_like(motion.x[0, -1], np.nan) if motion.failed[0] else motion.x[0, -1]
