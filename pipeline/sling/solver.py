"""Runs rod.h through Warp: builds the kernel for a mesh, lays out the lanes, steps a schedule."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock

import numpy as np

from pipeline.sling.model import GRAVITY, Sling, fixed_frames

_compiling = Lock()
LANES = {"cpu": 16, "cuda": 32}
NOT_CONVERGED, SLIPPED, LEFT = 1, 2, -1  # lane_state[4] as rod.h sets it
OFFSET, PAYLOAD, LEAVING, DIRECTION, FAILURE = slice(6, 9), 9, slice(10, 15), slice(1, 4), 4


@dataclass
class Schedule:
    """The steps that all lanes of a batch take.

    Attributes:
        table: h, c1, c2, beta, mode, hold, target x y z, normal force, blend, time, share of the
            bending stiffness; shape (S, 13).
        first_free: Index of the first step after the release.
    """

    table: np.ndarray
    first_free: int

    @property
    def times(self) -> np.ndarray:
        return self.table[:, 11]


RELAX, MOVE = 0, 1
FREE, HELD, OPENING, POUCH = 0, 1, 2, 3


RELAX_STEPS = 40


def relaxation(hold: int) -> np.ndarray:
    """Rows that bring a guess to rest, shape (RELAX_STEPS, 13): steps without speed, ever longer.

    Guesses have kinks. Inertia holds the first steps near them, and the bending stiffness comes in
    little by little; the last steps are statics.
    """
    ramp = RELAX_STEPS - 12
    sizes = np.concatenate([np.geomspace(2e-3, 0.05, ramp), np.full(12, 0.05)])
    table = steps(np.concatenate([[0.0], np.cumsum(sizes)]), sizes[0], hold=hold, mode=RELAX)
    table[:ramp, 12] = np.geomspace(0.01, 1, ramp)
    return table


def steps(times, previous: float, *, hold: int, order: int = 1, mode: int = MOVE) -> np.ndarray:
    """Rows of a schedule table that end at `times`, shape (S, 13): backward Euler or BDF2.

    Args:
        previous: Length of the step before the first one [s], for variable-step BDF2.
    """
    times = np.asarray(times, float)
    h = np.diff(times)
    table = np.zeros((len(h), 13))
    ratio = h / np.concatenate([[previous], h[:-1]])
    table[:, 0], table[:, 1], table[:, 3] = h, 1, 1
    if order == 2:
        table[:, 1] = (1 + ratio) ** 2 / (1 + 2 * ratio)
        table[:, 2] = ratio**2 / (1 + 2 * ratio)
        table[:, 3] = (1 + ratio) / (1 + 2 * ratio)
    table[:, 4], table[:, 5], table[:, 11], table[:, 12] = mode, hold, times[1:], 1
    return table


def _interleave(rows: np.ndarray, lanes: int, dtype) -> np.ndarray:
    """(N, k) -> (blocks, k, lanes); the last block repeats the last row."""
    blocks = -(-len(rows) // lanes)
    padded = np.concatenate([rows, np.repeat(rows[-1:], blocks * lanes - len(rows), axis=0)])
    return np.ascontiguousarray(padded.reshape(blocks, lanes, -1).transpose(0, 2, 1), dtype)


def _separate(array: np.ndarray, count: int) -> np.ndarray:
    """(blocks, k, lanes) -> (N, k)."""
    return array.transpose(0, 2, 1).reshape(-1, array.shape[1])[:count]


@dataclass
class Result:
    """State (N, layers, 9), lane_state (N, 16), output (N, S, 4), frames (N, K, layers, width)."""

    state: np.ndarray
    lane_state: np.ndarray
    output: np.ndarray
    frames: np.ndarray


def run(
    sling: Sling,
    schedule: Schedule,
    parameters: np.ndarray,
    state: np.ndarray,
    lane_state: np.ndarray,
    *,
    frame_steps=(),
    frame_weights=(),
    frame_width: int = 3,
    gravity: float = GRAVITY,
    payload: bool = False,
    device: str = "cpu",
    double: bool = False,
    workers: int = 1,
    tolerance: float = 2e-6,
    max_iterations: int = 80,
) -> Result:
    """Step N slings through a schedule.

    Args:
        parameters: As `model.material` gives them, shape (N, 6).
        state: Initial layers, shape (N, layers, 9) or (layers, 9).
        lane_state: As documented in rod.h, shape (N, 16).
        frame_steps, frame_weights: Step in which each frame falls and its place in it, shape (K,).
        frame_width: 3 for centre lines, 9 for all unknowns of each layer.
        payload: The launch of a projectile (lane_state[:, 9]) is followed until it leaves.
        workers: Threads, on the CPU; a result does not depend on their number.
    """
    import warp as wp

    from pipeline.sling.kernel import rod_kernel

    kind = "cuda" if device.startswith("cuda") else "cpu"
    lanes = LANES[kind] // (2 if double and kind == "cpu" else 1)
    count, dtype = len(parameters), np.float64 if double else np.float32
    kernel = rod_kernel(sling.layers, sling.middle, double, lanes)
    with _compiling:
        kernel.module.load(wp.get_device(device))
    table = schedule.table.astype(dtype)
    geometry = np.array(
        [
            sling.rest_length / sling.edges, sling.area, sling.radius**2,
            sling.mass / sling.rest_length, gravity, tolerance, 0.004, max_iterations,
            *sling.clamped,
        ],
        dtype,
    )  # fmt: skip
    state = np.broadcast_to(state, (count, sling.layers, 9)).reshape(count, -1)
    states = np.concatenate([state] * 3 + [np.zeros_like(state)] * 2 + [state], axis=1)
    first = np.searchsorted(frame_steps, np.arange(len(table) + 1)).astype(np.int32)
    weights = np.asarray(frame_weights, dtype) if len(frame_weights) else np.zeros(1, dtype)
    n_frames = len(frame_steps)
    blocks = [_interleave(rows, lanes, dtype) for rows in (parameters, states, lane_state)]
    n_blocks = len(blocks[0])
    lengths = sling.edge_lengths.astype(dtype)
    shared = [
        geometry,
        lengths,
        fixed_frames(sling).astype(dtype).ravel(),
        table.ravel(),
        first,
        weights,
    ]
    shared = [wp.array(array, device=device) for array in shared]

    def slice_of(part: slice):
        own = [wp.array(array[part].ravel(), device=device) for array in blocks]
        size = len(blocks[0][part])
        scalar = wp.float64 if double else wp.float32
        work = wp.empty(size * lanes * sling.layers * 135, dtype=scalar, device=device)
        output = wp.zeros(size * lanes * len(table) * 4, dtype=scalar, device=device)
        frames = wp.zeros(
            size * lanes * max(n_frames, 1) * sling.layers * frame_width, dtype=scalar, device=device
        )
        wp.launch(
            kernel,
            dim=size * (lanes if kind == "cuda" else 1),
            inputs=[
                *shared[:4], own[0], own[1], work, own[2], output, frames, *shared[4:],
                n_frames, frame_width, len(table), 0, len(table), schedule.first_free, int(payload),
            ],
            device=device,
            block_dim=lanes,
        )  # fmt: skip
        return [
            array.numpy().reshape(size, -1, lanes) for array in (own[1], own[2], output, frames)
        ]

    if kind == "cuda" or workers == 1 or n_blocks == 1:
        parts = [slice_of(slice(None))]
    else:
        slices = [slice(i, i + 1) for i in range(n_blocks)]
        with ThreadPoolExecutor(workers) as pool:
            parts = list(pool.map(slice_of, slices))
    states, lane_state, output, frames = (
        _separate(np.concatenate(arrays), count) for arrays in zip(*parts, strict=True)
    )
    return Result(
        state=states[:, sling.layers * 9 : 2 * sling.layers * 9].reshape(count, -1, 9),
        lane_state=lane_state,
        output=output.reshape(count, len(table), 4),
        frames=frames[:, : n_frames * sling.layers * frame_width].reshape(
            count, n_frames, sling.layers, frame_width
        ),
    )
