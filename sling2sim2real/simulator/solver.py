"""Runs the native text through Warp: a batch of slings through the steps of a schedule."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from sling2sim2real.simulator.initial import fixed_frames
from sling2sim2real.simulator.material import material
from sling2sim2real.simulator.model import CYLINDER_DRAG, DOFS, GRAVITY, ClampedBand
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.records import LANE, OUTPUT, SETTING, numbers, records, width
from sling2sim2real.simulator.rubber import RUBBER, memories, work
from sling2sim2real.simulator.schedule import Schedule

LANES_A_THREAD = 16  # slings in a CPU thread's SIMD lanes
THREADS_A_WARP = 32  # GPU threads that share a sling
STAGED = 84  # numbers that are staged of a section, as in state.h
NEWTON_STEP_LIMIT_M = 0.004  # m, of Newton's method


@dataclass(frozen=True)
class Slings:
    """N slings before their first step.

    Attributes:
        coefficients: Of their material, records (N,) of records.MATERIAL.
        state: Cross-sections, shape (N, sections, DOFS) or (sections, DOFS).
        lanes: Records (N,) of records.LANE.
    """

    coefficients: np.ndarray
    state: np.ndarray
    lanes: np.ndarray

    @classmethod
    def of(
        cls,
        band: ClampedBand,
        parameters: Parameters,
        state: np.ndarray,
        rigidity: float | np.ndarray | None = None,
        **lanes: float | np.ndarray,
    ) -> Slings:
        """Make slings of N parameters, at rest.

        `lanes` are fields of records.LANE, else 0 (`worst` else from what the band has seen).
        `rigidity` is as of `material`.
        """
        records = np.zeros(len(parameters), LANE)
        if band.law == RUBBER:
            shape = map(parameters.column, ("mooney_share", "upturn"))
            records["worst"] = work(np.array(band.stretched), *shape)
        for name, values in lanes.items():
            records[name] = values
        shape = len(parameters), band.sections, DOFS
        return cls(material(band, parameters, rigidity), np.broadcast_to(state, shape), records)

    def __len__(self) -> int:
        return len(self.lanes)

    def __getitem__(self, chosen) -> Slings:
        return Slings(self.coefficients[chosen], self.state[chosen], self.lanes[chosen])


@dataclass(frozen=True)
class Frames:
    """What is recorded on the way.

    Attributes:
        steps, weights: Step in which each frame falls and its place in it, shape (K,).
        width: Numbers of a cross-section: 3 of its centre, DOFS for all.
    """

    steps: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    weights: np.ndarray = field(default_factory=lambda: np.zeros(0))
    width: int = 3


@dataclass(frozen=True)
class Options:
    """How a batch is stepped.

    Attributes:
        device: cpu, or one GPU.
        workers: Threads, on the CPU; a result does not depend on their number.
        fetch: Copy what is long from a GPU.
        launching: The projectile (`payload`) is followed until it separates.
        double: In double precision.
        tolerance: Newton's change that is small enough [m].
    """

    device: str = "cpu"
    workers: int = 1
    fetch: bool = True
    launching: bool = False
    double: bool = False
    gravity: float = GRAVITY
    tolerance: float = 2e-6
    max_iterations: int = 100

    @property
    def on_gpu(self) -> bool:
        return self.device.startswith("cuda")


@dataclass
class Stepped:
    """N slings after S steps, K frames recorded.

    Attributes:
        state: At the end, shape (N, sections, DOFS).
        lanes: Records (N,) of records.LANE.
        output: Force on the hand and Newton iterations of each step, shape (N, S, 4), in the order
            of records.OUTPUT; empty for launches.
        frames: Shape (N, K, sections, width). This and `output` are what is long: from a GPU they
            come as Warp arrays that stay there, if asked for.
    """

    state: np.ndarray
    lanes: np.ndarray
    output: np.ndarray
    frames: np.ndarray


def run(
    sling: ClampedBand,
    schedule: Schedule,
    slings: Slings,
    frames: Frames | None = None,
    options: Options | None = None,
) -> Stepped:
    """Step N slings of one geometry through a schedule."""
    frames, options = frames or Frames(), options or Options()
    work = _Work(sling, schedule, slings, frames, options)
    if options.on_gpu or options.workers == 1 or work.rows == 1:
        arrays = work.part(0, work.rows)
    else:
        with ThreadPoolExecutor(options.workers) as pool:
            parts = list(pool.map(lambda row: work.part(row, row + 1), range(work.rows)))
        arrays = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    count = len(slings)
    state, lanes, output, recorded = (arrays[name][:count] for name in RETURNED)
    n_steps = 0 if options.launching else len(schedule.steps)
    return Stepped(
        state=state.reshape((count, DOFS, sling.sections)).swapaxes(1, 2),
        lanes=records(lanes, LANE),
        output=output.reshape((count, n_steps, width(OUTPUT))),
        frames=recorded.reshape((count, len(frames.steps), sling.sections, frames.width)),
    )


def memory(sling: ClampedBand, schedule: Schedule, n_frames: int, options: Options) -> int:
    """Bytes that one rollout takes in single precision while it is simulated."""
    frames = Frames(np.zeros(n_frames, int), np.zeros(n_frames))
    return 4 * sum(_widths(sling, schedule, frames, options).values())


RETURNED = ("state", "lanes", "output", "frames")
MAY_STAY_ON_GPU = ("output", "frames")


def _widths(
    sling: ClampedBand, schedule: Schedule, frames: Frames, options: Options
) -> dict[str, int]:
    """Numbers that each array which a kernel writes holds of one sling."""
    stored = ((2 * DOFS + 2) * (DOFS + 1) + STAGED) * sling.sections
    if options.on_gpu:  # by two chains, and for spare threads; sections are staged in shared memory
        stored = (2 * DOFS + 2) * (sling.middle + 1) * THREADS_A_WARP
    return {
        "state": DOFS * sling.sections,
        "lanes": width(LANE),
        "scratch": (9 * DOFS + memories(sling.law) + 4) * sling.sections,
        "work": stored,
        "output": 0 if options.launching else width(OUTPUT) * len(schedule.steps),
        "frames": len(frames.steps) * sling.sections * frames.width,
    }


class _Work:
    """A batch laid out for a device: slings in rows of SIMD lanes, or one each for a GPU's warps.

    Attributes:
        rows: How many there are.
    """

    def __init__(
        self,
        sling: ClampedBand,
        schedule: Schedule,
        slings: Slings,
        frames: Frames,
        options: Options,
    ) -> None:
        from sling2sim2real.simulator.kernel import sling_kernel

        on_gpu, self.options = options.on_gpu, options
        self.lanes = 1 if on_gpu else LANES_A_THREAD // (2 if options.double else 1)
        self.dtype = np.float64 if options.double else np.float32
        mesh = sling.law, sling.sections, sling.middle
        self.kernel, self.arrays = sling_kernel(*mesh, options.double, self.lanes, on_gpu)
        self.widths = _widths(sling, schedule, frames, options)
        self.common = self._common(sling, schedule, frames)
        state = slings.state.swapaxes(1, 2).reshape(len(slings), -1)
        self.given = {
            "coefficients": self._interleave(numbers(slings.coefficients)),
            "state": self._interleave(state),
            "lanes": self._interleave(numbers(slings.lanes)),
        }
        self.rows = len(self.given["state"])

    def _common(self, sling: ClampedBand, schedule: Schedule, frames: Frames) -> dict:
        """What all slings share."""
        values = {
            "setting": numbers(_setting(sling, self.options)),
            "mesh": sling.edge_lengths,
            "clamp": fixed_frames(sling),
            "schedule": numbers(schedule.steps),
            "frame_weight": np.append(frames.weights, 0.0),
        }
        n_steps = len(schedule.steps)
        first = np.searchsorted(frames.steps, np.arange(n_steps + 1)).astype(np.int32)
        return {name: self._array(array.astype(self.dtype)) for name, array in values.items()} | {
            "frame_first": self._array(first),
            "n_frames": len(frames.steps),
            "frame_width": frames.width,
            "steps": n_steps,
            "first_free": schedule.first_free,
            "launching": int(self.options.launching),
        }

    def _array(self, values: np.ndarray):
        import warp as wp

        return wp.array(np.ravel(values), device=self.options.device)

    def _interleave(self, rows: np.ndarray) -> np.ndarray:
        """(N, k) -> (rows, k, lanes); the last sling fills up what one thread steps."""
        count, lanes = len(rows), self.lanes
        blocks = -(-count // lanes)
        padded = np.concatenate([rows, np.repeat(rows[-1:], blocks * lanes - count, axis=0)])
        by_lane = padded.reshape(blocks, lanes, -1).transpose(0, 2, 1)
        return np.ascontiguousarray(by_lane, self.dtype)

    def part(self, begin: int, end: int) -> dict:
        """Step the slings of rows from `begin` to `end`; arrays (slings, width) of RETURNED."""
        import warp as wp

        from sling2sim2real.base.native import empty, run_kernel

        size, device = end - begin, self.options.device
        scalar = wp.dtype_from_numpy(self.dtype)
        arrays = self.common | {
            name: self._array(rows[begin:end]) for name, rows in self.given.items()
        }
        for name in self.widths.keys() - arrays.keys():
            length = size * self.lanes * self.widths[name]
            arrays[name] = empty(length, scalar, device)
        given = self.arrays()
        for name, values in arrays.items():
            setattr(given, name, values)
        run_kernel(self.kernel, size, [given], device)
        return {name: self._fetched(name, arrays[name], size) for name in RETURNED}

    def _fetched(self, name: str, array, size: int):
        """A result of each sling, (slings, width); what is long may stay on a GPU."""
        if name in MAY_STAY_ON_GPU and self.options.on_gpu and not self.options.fetch:
            return array.reshape((size, self.widths[name]))
        values = array.numpy().reshape(size, self.widths[name], self.lanes)
        return values.transpose(0, 2, 1).reshape(size * self.lanes, self.widths[name])


def _setting(sling: ClampedBand, options: Options) -> np.ndarray:
    """A record of records.SETTING, shape (1,)."""
    result = np.zeros(1, SETTING)
    values = {
        "mean_edge": sling.rest_length / sling.edges,
        "area": sling.area,
        "radius2": sling.radius**2,
        "line_mass": sling.mass / sling.rest_length,
        "wind": CYLINDER_DRAG * sling.air_density * sling.radius,
        "gravity": options.gravity,
        "tolerance": options.tolerance,
        "step_limit": NEWTON_STEP_LIMIT_M,
        "max_iterations": options.max_iterations,
        "clamped": sling.clamped,
        "shortest": sling.edge_lengths.min(),
    }
    for name, value in values.items():
        result[name] = value
    return result
