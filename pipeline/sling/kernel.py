"""The native text of the simulator as a Warp kernel, one for each mesh.

(Warp reads annotations: no postponed ones here.)
"""

from pathlib import Path

import warp as wp

from pipeline.native import built_once, text_of

PARTS = ("lanes.h", "state.h", "material.h", "rod.h", "step.h")
UNKNOWNS = 9  # of a layer
SAVED = 2 * UNKNOWNS + 1  # numbers of a column that the back substitution needs


@built_once
def rod_kernel(layers: int, middle: int, double: bool, lanes: int, team: int):
    """Compile the native text for a mesh; Warp keeps the binary in its cache."""
    scalar = wp.float64 if double else wp.float32
    array, indices = wp.array(dtype=scalar), wp.array(dtype=wp.int32)
    text = text_of(
        *(Path(__file__).with_name(part) for part in PARTS),
        SC="double" if double else "float",
        W=lanes,
        T=team,
        N=UNKNOWNS,
        L=layers,
        MID=middle,
    )

    @wp.func_native(text)
    def rod(
        tid: int,
        geometry: array,
        lengths: array,
        clamp: array,
        schedule: array,
        parameter: array,
        state: array,
        scratch: array,
        work: array,
        lane_state: array,
        output: array,
        frames: array,
        frame_first: indices,
        frame_weight: array,
        n_frames: int,
        frame_width: int,
        steps: int,
        first_free: int,
        launching: int,
    ): ...

    # approximate reciprocals do for Newton's method; on the CPU it would drop the checks for NaN
    @wp.kernel(module="unique", module_options={"fast_math": team > 1})
    def run(
        geometry: array,
        lengths: array,
        clamp: array,
        schedule: array,
        parameter: array,
        state: array,
        scratch: array,
        work: array,
        lane_state: array,
        output: array,
        frames: array,
        frame_first: indices,
        frame_weight: array,
        n_frames: int,
        frame_width: int,
        steps: int,
        first_free: int,
        launching: int,
    ):
        rod(
            wp.tid(), geometry, lengths, clamp, schedule, parameter, state, scratch, work,
            lane_state, output, frames, frame_first, frame_weight, n_frames, frame_width, steps,
            first_free, launching,
        )  # fmt: skip

    return run
