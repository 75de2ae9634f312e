"""rod.h as a Warp kernel, one for each mesh. (Warp reads annotations: no postponed ones here.)"""

from functools import lru_cache
from pathlib import Path

import warp as wp

TEXT = Path(__file__).with_name("rod.h")
wp.config.log_level = wp.LOG_ERROR
wp.config.enable_backward = False


@lru_cache
def rod_kernel(layers: int, middle: int, double: bool, lanes: int):
    """Compile rod.h for a mesh; Warp keeps the binary in its cache."""
    scalar = wp.float64 if double else wp.float32
    array, indices = wp.array(dtype=scalar), wp.array(dtype=wp.int32)
    macros = {"SC": "double" if double else "float", "W": lanes, "L": layers, "MID": middle}
    defines = "".join(f"#define {name} {value}\n" for name, value in macros.items())
    text = "\n" + defines + TEXT.read_text() + "".join(f"#undef {name}\n" for name in macros)

    @wp.func_native(text)
    def rod(
        tid: int,
        geometry: array,
        lengths: array,
        clamp: array,
        schedule: array,
        parameter: array,
        state: array,
        work: array,
        lane_state: array,
        output: array,
        frames: array,
        frame_first: indices,
        frame_weight: array,
        n_frames: int,
        frame_width: int,
        steps: int,
        first_step: int,
        last_step: int,
        first_free: int,
        payload_steps: int,
    ): ...

    @wp.kernel(module="unique")
    def run(
        geometry: array,
        lengths: array,
        clamp: array,
        schedule: array,
        parameter: array,
        state: array,
        work: array,
        lane_state: array,
        output: array,
        frames: array,
        frame_first: indices,
        frame_weight: array,
        n_frames: int,
        frame_width: int,
        steps: int,
        first_step: int,
        last_step: int,
        first_free: int,
        payload_steps: int,
    ):
        rod(
            wp.tid(), geometry, lengths, clamp, schedule, parameter, state, work,
            lane_state, output, frames, frame_first, frame_weight, n_frames, frame_width, steps, first_step,
            last_step, first_free, payload_steps,
        )  # fmt: skip

    return run
