"""What the checks have in common: a straight band, steps of it with every state, its rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pipeline.sling.initial import fixed_frames, sections_of
from pipeline.sling.material import material
from pipeline.sling.model import GRAVITY, Sling
from pipeline.sling.solver import (
    FAILURE,
    FREE,
    HELD,
    LANE_STATE,
    PAYLOAD,
    POUCH,
    RELAX,
    Schedule,
    relaxation,
    run,
    steps,
)
from validation.simulator.check import Bench

TIGHT = {"double": True, "tolerance": 1e-12}  # the kernel as exact as it gets


@dataclass(frozen=True)
class Motion:
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


def band_of(bench: Bench) -> Sling:
    """The first band of params.yaml as a rod of the default resolution, round and solid."""
    params = bench.params
    band = params.bands[next(iter(params.bands))]
    return Sling.of(band, params.setup, params.sling, as_rod=True)


def straight(sling: Sling, length: float, **changes) -> Sling:
    """A band whose clamps are `length` apart and in line."""
    return replace(
        sling, half_width=length / 2, clamp_direction=np.array([1.0, 0.0, 0.0]), **changes
    )


def straight_guess(sling: Sling, first_half: float | None = None) -> np.ndarray:
    """Sections (L, 9) of a straight band, its first half stretched to `first_half` [m]."""
    middle = 0.0 if first_half is None else first_half - sling.half_width
    place = [0.0, sling.arc[sling.middle], sling.rest_length]
    nodes = np.zeros((sling.sections, 3))
    nodes[:, 0] = np.interp(sling.arc, place, [-sling.half_width, middle, sling.half_width])
    return sections_of(sling, nodes)


def launched(h: float, count: int, order: int = 2, hold: int = FREE) -> np.ndarray:
    """Rows of `count` steps of `h` from rest; second order begins with one of backward Euler."""
    first = steps([0.0, h], h, hold=hold)
    return np.vstack([first, steps(h * np.arange(1, count + 1), h, hold=hold, order=order)])


def settling(hold: int = FREE, target=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Rows that bring a guess to rest whatever its own times are, the held node at `target`."""
    table = relaxation(hold)
    last = steps(10.0 ** np.arange(1, 6), 1.0, hold=hold, mode=RELAX)
    table = np.vstack([table, last])
    table[:, 6:9] = target
    table[:, 9] = 1e9  # pads that hold anything
    return table


def move(
    bench: Bench,
    sling: Sling,
    thetas,
    table: np.ndarray,
    start: np.ndarray,
    *,
    payload: float = 0.0,
    gravity: float = GRAVITY,
    double: bool = False,
    tolerance: float = 2e-6,
) -> Motion:
    """Step N thetas (N, 5) from `start` (N, L, 9) or (L, 9), at rest, through `table` (S, 13)."""
    thetas, start = np.atleast_2d(thetas), np.array(start, float)
    start[..., -1, 3:] = fixed_frames(sling)[1].ravel()  # the last clamp's, whatever was before
    count = len(table)
    lanes = np.zeros((len(thetas), LANE_STATE))
    lanes[:, PAYLOAD] = payload
    result = run(
        sling,
        Schedule(table, first_free=count),
        material(sling, thetas),
        start,
        lanes,
        frame_steps=np.arange(count),
        frame_weights=np.ones(count),
        frame_width=9,
        gravity=gravity,
        device=bench.device,
        workers=bench.workers,
        double=double,
        tolerance=tolerance,
    )
    x = result.frames.astype(float)
    start = np.broadcast_to(start, (len(thetas), *x.shape[2:]))
    return Motion(
        table,
        start,
        x,
        *rates(sling.middle, table, start, x),
        force=result.output[:, :, :3].astype(float),
        failed=result.lane_state[:, FAILURE] > 0,
    )


def rates(
    middle: int, table: np.ndarray, start: np.ndarray, x: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rates and predicted states (N, S, L, 9) of recorded states, from the steps' formula."""
    v, at = np.empty_like(x), np.empty_like(x)
    x1 = x2 = start
    v1 = np.zeros_like(start)
    for k, row in enumerate(table):
        h, c1, c2, beta, mode, hold = row[:6]
        at[:, k] = x1 + h * v1
        if hold in (HELD, POUCH):  # the hand leads it
            at[:, k, middle, :3] = x[:, k, middle, :3]
        v[:, k] = 0.0 if mode == RELAX else (x[:, k] - c1 * x1 + c2 * x2) / (beta * h)
        x1, x2, v1 = x[:, k], (x[:, k] if mode == RELAX else x1), v[:, k]
    return v, at


def rest(bench: Bench, sling: Sling, theta, start, *, table=None, **options) -> np.ndarray:
    """Sections (L, 9) of one band at rest."""
    table = settling() if table is None else table
    motion = move(bench, sling, theta, table, start, **options)
    return np.full_like(motion.x[0, -1], np.nan) if motion.failed[0] else motion.x[0, -1]
