"""Runs the native text through Warp: the kernel for a mesh, lanes in rows, steps of a schedule."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from pipeline.base.errors import UserError
from pipeline.sling import tetrahedra
from pipeline.sling.initial import fixed_frames
from pipeline.sling.model import GRAVITY, TETRAHEDRA, Sling

LANES, TEAM = 16, 10  # slings in a CPU thread's SIMD lanes; GPU threads that share a sling
NOT_CONVERGED, SLIPPED, LEFT = 1, 2, -1  # lane_state[4] as state.h says
DIRECTION, PAYLOAD, FAILURE, SEPARATION, HELD_FORCE = slice(0, 3), 3, 4, slice(5, 10), slice(10, 13)
ITERATIONS, LANE_STATE = 13, 14


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


def _separate(array: np.ndarray) -> np.ndarray:
    """(blocks, k, lanes) -> (slings, k)."""
    blocks, width, lanes = array.shape
    return array.transpose(0, 2, 1).reshape(blocks * lanes, width)


def _widths(
    sling: Sling, n_steps: int, n_frames: int, frame_width: int, launching: bool, on_gpu: bool
) -> dict[str, int]:
    """Numbers that each array holds of one sling."""
    # of a GPU, a warp's spare threads count
    columns = -(-32 // (32 // TEAM)) if on_gpu else sling.dofs + 1
    return {
        "state": sling.dofs * sling.sections,
        "lane_state": LANE_STATE,
        "scratch": 9 * sling.dofs * sling.sections,
        "saved": (2 * sling.dofs + 1) * sling.sections * columns,
        "output": 0 if launching else 4 * n_steps,
        "frames": n_frames * sling.sections * frame_width,
    }


def memory(sling: Sling, schedule: Schedule, n_frames: int, device: str = "cpu") -> int:
    """Bytes that one rollout takes in single precision while it is simulated."""
    on_gpu = device.startswith("cuda")
    return 4 * sum(_widths(sling, len(schedule.table), n_frames, 3, False, on_gpu).values())


@dataclass
class Result:
    """Of N slings through S steps, K frames recorded.

    Attributes:
        state: At the end, shape (N, sections, dofs).
        lane_state: As documented in state.h, shape (N, LANE_STATE).
        output: Force on the hand and Newton iterations of each step, shape (N, S, 4); empty for
            launches.
        frames: Shape (N, K, sections, width). This and `output` are what is long: from a GPU they
            come as Warp arrays that stay there, if asked for.
    """

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
    launching: bool = False,
    device: str = "cpu",
    fetch: bool = True,
    double: bool = False,
    workers: int = 1,
    tolerance: float = 2e-6,
    max_iterations: int = 80,
) -> Result:
    """Step N slings through a schedule.

    Args:
        parameters: As `model.material` gives them, shape (N, 7).
        state: Initial sections, shape (N, sections, dofs) or (sections, dofs).
        lane_state: As documented in state.h, shape (N, LANE_STATE).
        frame_steps, frame_weights: Step in which each frame falls and its place in it, shape (K,).
        frame_width: 3 for centre lines, `sling.dofs` for all of each section.
        launching: The projectile (lane_state[:, PAYLOAD]) is followed until it leaves.
        fetch: Copy what is long from a GPU.
        workers: Threads, on the CPU; a result does not depend on their number.
        tolerance: Newton's change that is small enough [m].

    Raises:
        UserError: Tetrahedra on a GPU.
    """
    import warp as wp

    from pipeline.base.native import launch
    from pipeline.sling.kernel import sling_kernel

    if lane_state.shape != (len(parameters), LANE_STATE):
        raise ValueError(f"lane_state: {lane_state.shape} is not ({len(parameters)}, {LANE_STATE})")
    on_gpu = device.startswith("cuda")
    if on_gpu and sling.mesh == TETRAHEDRA:
        raise UserError("sling.mesh: tetrahedra run on the CPU alone; on a GPU take the rod")
    dtype, scalar = (np.float64, wp.float64) if double else (np.float32, wp.float32)
    lanes, team = (1, TEAM) if on_gpu else (LANES // (2 if double else 1), 1)
    together = 32 // team if on_gpu else 1  # rows of slings that one thread (one warp) steps
    sections, dofs = sling.sections, sling.dofs
    count, n_steps, n_frames = len(parameters), len(schedule.table), len(frame_steps)
    kernel = sling_kernel(sling.mesh, dofs, sections, sling.middle, double, lanes, team)

    mesh, shortest = sling.edge_lengths, sling.edge_lengths.min()
    if sling.mesh == TETRAHEDRA:
        mesh = np.concatenate([mesh, tetrahedra.table(sling.radius)])
        shortest = min(shortest, sling.radius)
    geometry = [
        sling.rest_length / sling.edges, sling.area, sling.radius**2,
        sling.mass / sling.rest_length, gravity, tolerance, 0.004, max_iterations,
        *sling.clamped, shortest,
    ]  # fmt: skip
    first = np.searchsorted(frame_steps, np.arange(n_steps + 1)).astype(np.int32)
    common = [
        wp.array(np.ravel(values).astype(dtype), device=device)
        for values in (geometry, mesh, fixed_frames(sling), schedule.table)
    ]
    stamps = [
        wp.array(first, device=device),
        wp.array(np.append(frame_weights, 0.0).astype(dtype), device=device),
    ]
    state = np.broadcast_to(state, (count, sections, dofs)).swapaxes(1, 2).reshape(count, -1)
    rows = [
        _interleave(values, lanes, together, dtype) for values in (parameters, state, lane_state)
    ]

    widths = _widths(sling, n_steps, n_frames, frame_width, launching, on_gpu)

    def part(begin: int, end: int) -> list:
        """Step the rows of slings from `begin` to `end`; arrays (slings, width)."""
        size = end - begin
        parameter, state, lane = (
            wp.array(values[begin:end].ravel(), device=device) for values in rows
        )
        scratch, saved, output, frames = (
            wp.empty(size * lanes * widths[name], dtype=scalar, device=device)
            for name in ("scratch", "saved", "output", "frames")
        )
        inputs = [
            *common, parameter, state, scratch, saved, lane, output, frames, *stamps,
            n_frames, frame_width, n_steps, schedule.first_free, int(launching),
        ]  # fmt: skip
        launch(kernel, size // together, inputs, device)
        arrays = {"state": state, "lane_state": lane, "output": output, "frames": frames}
        stays = () if fetch or not on_gpu else ("output", "frames")
        return [
            array.reshape((size, widths[name]))
            if name in stays
            else _separate(array.numpy().reshape(size, widths[name], lanes))
            for name, array in arrays.items()
        ]

    n_rows = len(rows[0])
    if on_gpu or workers == 1 or n_rows == 1:
        arrays = part(0, n_rows)
    else:
        with ThreadPoolExecutor(workers) as pool:
            parts = list(pool.map(lambda row: part(row, row + 1), range(n_rows)))
        arrays = [np.concatenate(values) for values in zip(*parts, strict=True)]
    state, lane_state, output, frames = (array[:count] for array in arrays)
    return Result(
        state=state.reshape((count, dofs, sections)).swapaxes(1, 2),
        lane_state=lane_state,
        output=output.reshape((count, 0 if launching else n_steps, 4)),
        frames=frames.reshape((count, n_frames, sections, frame_width)),
    )
