"""Runs rod.h through Warp: builds the kernel for a mesh, lays out the lanes, steps a schedule."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Lock

import numpy as np

from pipeline.sling.model import GRAVITY, Sling, fixed_frames

_compiling = Lock()
LANES, TEAM = 16, 10  # slings in a CPU thread's SIMD lanes; GPU threads that share a sling
NOT_CONVERGED, SLIPPED, LEFT = 1, 2, -1  # lane_state[4] as state.h says
DIRECTION, PAYLOAD, FAILURE, LEAVING, LANE_STATE = slice(0, 3), 3, 4, slice(6, 11), 11


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


def _interleave(rows: np.ndarray, lanes: int, together: int, dtype) -> np.ndarray:
    """(N, k) -> (blocks, k, lanes); the last row fills up to a multiple of `together` blocks."""
    blocks = -(-len(rows) // (lanes * together)) * together
    padded = np.concatenate([rows, np.repeat(rows[-1:], blocks * lanes - len(rows), axis=0)])
    return np.ascontiguousarray(padded.reshape(blocks, lanes, -1).transpose(0, 2, 1), dtype)


def _separate(array: np.ndarray, count: int) -> np.ndarray:
    """(blocks, k, lanes) -> (N, k)."""
    return array.transpose(0, 2, 1).reshape(-1, array.shape[1])[:count]


@dataclass
class Result:
    """State (N, layers, 9), lane_state (N, LANE_STATE), output (N, S, 4), frames (N, K, layers, width)."""

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
        lane_state: As documented in state.h, shape (N, LANE_STATE).
        frame_steps, frame_weights: Step in which each frame falls and its place in it, shape (K,).
        frame_width: 3 for centre lines, 9 for all unknowns of each layer.
        payload: The launch of a projectile (lane_state[:, 9]) is followed until it leaves.
        workers: Threads, on the CPU; a result does not depend on their number.
    """
    import warp as wp

    from pipeline.sling.kernel import rod_kernel

    if lane_state.shape != (len(parameters), LANE_STATE):
        raise ValueError(f"lane_state: {lane_state.shape} is not ({len(parameters)}, {LANE_STATE})")

    on_gpu, dtype = device.startswith("cuda"), np.float64 if double else np.float32
    lanes, team = (1, TEAM) if on_gpu else (LANES // (2 if double else 1), 1)
    together = 32 // team if on_gpu else 1  # blocks that a warp steps
    count, layers = len(parameters), sling.layers
    kernel = rod_kernel(layers, sling.middle, double, lanes, team)
    with _compiling:
        kernel.module.load(wp.get_device(device))
    table = schedule.table.astype(dtype)
    geometry = np.array(
        [
            sling.rest_length / sling.edges, sling.area, sling.radius**2,
            sling.mass / sling.rest_length, gravity, tolerance, 0.004, max_iterations,
            *sling.clamped, sling.edge_lengths.min(),
        ],
        dtype,
    )  # fmt: skip
    state = np.broadcast_to(state, (count, layers, 9)).swapaxes(1, 2).reshape(count, -1)
    first = np.searchsorted(frame_steps, np.arange(len(table) + 1)).astype(np.int32)
    weights = np.asarray(frame_weights, dtype) if len(frame_weights) else np.zeros(1, dtype)
    n_frames = len(frame_steps)
    blocks = [
        _interleave(values, lanes, together, dtype) for values in (parameters, state, lane_state)
    ]
    n_blocks = len(blocks[0])
    shared = [
        geometry,
        sling.edge_lengths.astype(dtype),
        fixed_frames(sling).astype(dtype).ravel(),
        table.ravel(),
        first,
        weights,
    ]
    shared = [wp.array(array, device=device) for array in shared]
    scalar = wp.float64 if double else wp.float32
    kept = layers * 19 * (32 if on_gpu else 10 * lanes) // together

    def slice_of(part: slice):
        parameter, state, lane = (wp.array(array[part].ravel(), device=device) for array in blocks)
        size = len(blocks[0][part])
        scratch = wp.empty(size * lanes * layers * 81, dtype=scalar, device=device)
        work = wp.empty(size * kept + 32, dtype=scalar, device=device)
        output = wp.zeros(size * lanes * len(table) * 4, dtype=scalar, device=device)
        frames = wp.zeros(
            size * lanes * max(n_frames, 1) * layers * frame_width, dtype=scalar, device=device
        )
        wp.launch(
            kernel,
            dim=size // together * 32 if on_gpu else size,
            inputs=[
                *shared[:4], parameter, state, scratch, work, lane, output, frames, *shared[4:],
                n_frames, frame_width, len(table), schedule.first_free, int(payload),
            ],
            device=device,
            block_dim=32,
        )  # fmt: skip
        return [array.numpy().reshape(size, -1, lanes) for array in (state, lane, output, frames)]

    if on_gpu or workers == 1 or n_blocks == 1:
        parts = [slice_of(slice(None))]
    else:
        slices = [slice(i, i + 1) for i in range(n_blocks)]
        with ThreadPoolExecutor(workers) as pool:
            parts = list(pool.map(slice_of, slices))
    state, lane_state, output, frames = (
        _separate(np.concatenate(arrays) if len(arrays) > 1 else arrays[0], count)
        for arrays in zip(*parts, strict=True)
    )
    return Result(
        state=state.reshape(count, 9, layers).swapaxes(1, 2),
        lane_state=lane_state,
        output=output.reshape(count, len(table), 4),
        frames=frames[:, : n_frames * layers * frame_width].reshape(
            count, n_frames, layers, frame_width
        ),
    )
