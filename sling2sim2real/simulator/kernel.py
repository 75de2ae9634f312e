"""The native text of the simulator as a Warp kernel, one for each law and mesh.

(Warp reads annotations: no postponed ones here.)
"""

# Warp's annotations are values, and what its decorators give is no function any more:
# pyright: reportInvalidTypeForm=false, reportGeneralTypeIssues=false, reportReturnType=false
# pyright: reportArgumentType=false

from pathlib import Path

import warp as wp

from sling2sim2real.base.native import built_once, text_of
from sling2sim2real.simulator.model import DOFS
from sling2sim2real.simulator.records import macros
from sling2sim2real.simulator.rubber import memories


@built_once
def sling_kernel(
    law: str,
    sections: int,
    middle: int,
    double: bool,
    lanes: int,
    on_gpu: bool,
) -> tuple[wp.Kernel, type]:
    """Compile the native text for a mesh; Warp keeps the binary in its cache.

    Returns:
        The kernel, and the structure of arrays that it takes.
    """
    scalar = wp.float64 if double else wp.float32
    array, indices = wp.array(dtype=scalar), wp.array(dtype=wp.int32)

    @wp.struct
    class Arrays:
        setting: array
        mesh: array
        clamp: array
        schedule: array
        coefficients: array
        state: array
        scratch: array
        work: array
        lanes: array
        output: array
        frames: array
        frame_first: indices
        frame_weight: array
        n_frames: int
        frame_width: int
        steps: int
        first_free: int
        launching: int

    parts = ("lanes.h", "state.h", "material.h", f"{law}.h", "rod.h", "solve.h", "step.h")
    text = text_of(
        *(Path(__file__).with_name(part) for part in parts),
        arrays=Arrays,
        scalar="double" if double else "float",
        WIDTH=lanes,
        DOFS=DOFS,
        SECTIONS=sections,
        MIDDLE=middle,
        MEMORIES=memories(law),
        **macros(),
    )

    @wp.func_native(text)
    def march(tid: int, arrays: Arrays): ...

    # approximate reciprocals do for Newton's method; on the CPU it would drop the checks for NaN
    @wp.kernel(module="unique", module_options={"fast_math": on_gpu})
    def run(arrays: Arrays):
        march(wp.tid(), arrays)

    return run, Arrays
