"""The loss as Warp kernels, for both devices. (Warp reads annotations: no postponed ones here.)"""

# Warp's annotations are values, and what its decorators give is no function any more:
# pyright: reportInvalidTypeForm=false, reportGeneralTypeIssues=false, reportReturnType=false
# pyright: reportArgumentType=false, reportOperatorIssue=false, reportIndexIssue=false
# pyright: reportCallIssue=false, reportAssignmentType=false

import math
from pathlib import Path

import warp as wp

from sling2sim2real.base.native import built_once, text_of

SAMPLES = 3  # simulated points an edge of the tube
RINGS, RING_VERTICES = (
    125,
    8,
)  # vertices along the band and around it: as many as a measured cloud has


@built_once
def chamfer_kernel(
    surface: str, edges: int, lanes: int, culled: bool = True
) -> tuple[wp.Kernel, type]:
    """Compile chamfer.h for a band's mesh; Warp keeps the binary in its cache.

    Args:
        surface: "tube" or "mesh".

    Returns:
        The kernel, and the structure of arrays that it takes.
    """
    floats, integers = wp.array(dtype=wp.float32), wp.array(dtype=wp.int32)

    @wp.struct
    class CloudArrays:
        line: floats
        points: floats
        balls: floats
        frame_blocks: integers
        frame_groups: integers
        frames: int
        radius: float
        rest_edges: floats
        camera: wp.vec3
        errors: floats

    macros: dict[str, int | str] = {"EDGES": edges, "CULLED": int(culled), "CPU_LANES": lanes}
    if surface == "tube":
        macros |= {"PARTS": edges, "VERTICES": SAMPLES}
    else:
        macros |= {"PARTS": RINGS, "VERTICES": RING_VERTICES}
        for name, turn in (("COSINES", math.cos), ("SINES", math.sin)):
            numbers = (
                f"{turn(2 * math.pi * k / RING_VERTICES):.9f}f" for k in range(RING_VERTICES)
            )
            macros[name] = "{" + ", ".join(numbers) + "}"
    paths = (Path(__file__).with_name(f"{name}.h") for name in ("lanes", surface, "chamfer"))

    @wp.func_native(text_of(*paths, arrays=CloudArrays, **macros))
    def distances(tid: int, arrays: CloudArrays): ...

    @wp.kernel(module="unique")
    def run(arrays: CloudArrays):
        distances(wp.tid(), arrays)

    return run, CloudArrays


@built_once
def terms_kernels(scalar: type) -> tuple[wp.Kernel, wp.Kernel]:
    """The filter of forces of a type, and the terms of the loss; in double precision.

    `filtered` has a thread for each sample of each rollout, `terms` one for each rollout: sums are
    in a fixed order.
    """
    doubles, integers = wp.array(dtype=wp.float64), wp.array(dtype=wp.int32)
    vectors = wp.array(dtype=wp.vec3d)

    @wp.kernel(module="unique")
    def filtered(
        force: wp.array3d(dtype=scalar),  # (N, S, 3) [N]
        first: integers,  # of the filter's rows, (T + 1,)
        columns: integers,
        values: doubles,
        out: wp.array2d(dtype=wp.vec3d),  # (N, T)
    ):
        rollout, sample = wp.tid()
        total = wp.vec3d()
        for i in range(first[sample], first[sample + 1]):
            step = columns[i]
            here = wp.vec3d(
                wp.float64(force[rollout, step, 0]),
                wp.float64(force[rollout, step, 1]),
                wp.float64(force[rollout, step, 2]),
            )
            total += values[i] * here
        out[rollout, sample] = total

    @wp.func
    def median(signal: vectors, sample: int, window: int) -> wp.vec3d:
        last, half = signal.shape[0] - 1, window // 2
        found = signal[sample]  # if all are NaN
        for i in range(window):
            x = signal[wp.clamp(sample + i - half, 0, last)]
            below = wp.vec3i()
            for j in range(window):
                y = signal[wp.clamp(sample + j - half, 0, last)]
                for axis in range(3):
                    if y[axis] < x[axis] or (y[axis] == x[axis] and j < i):
                        below[axis] += 1
            for axis in range(3):
                if below[axis] == half:
                    found[axis] = x[axis]
        return found

    @wp.kernel(module="unique")
    def terms(
        simulated: wp.array2d(dtype=wp.vec3d),  # filtered (N, T) [N]
        measured: vectors,  # (T,) [N]
        velocity: vectors,  # (T,) [m/s]
        period: wp.float64,  # of the samples [s]
        errors: wp.array3d(dtype=wp.float32),  # (N, K, 2) [m]
        frame_weights: doubles,  # (K,) [1/m]
        window: int,
        out: vectors,  # geom, force, work; (N,)
    ):
        rollout = wp.tid()
        count = measured.shape[0]
        force, work, geom = wp.float64(0.0), wp.float64(0.0), wp.float64(0.0)
        share = wp.float64(1.0) / wp.float64(count)
        for sample in range(count):
            gap = measured[sample] - median(simulated[rollout], sample, window)
            force += share * wp.length(gap)
            lasts = period
            if sample == 0 or sample == count - 1:
                lasts = period / wp.float64(2.0)
            work += lasts * wp.dot(gap, velocity[sample])
        for frame in range(frame_weights.shape[0]):
            if frame_weights[frame] != wp.float64(0.0):  # an empty one's error is NaN
                pair = wp.float64(errors[rollout, frame, 0]) + wp.float64(errors[rollout, frame, 1])
                geom += frame_weights[frame] * (pair / wp.float64(2.0))
        out[rollout] = wp.vec3d(geom, force, wp.abs(work))

    return filtered, terms
