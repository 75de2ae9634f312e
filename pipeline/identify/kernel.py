"""chamfer.h as a Warp kernel. (Warp reads annotations: no postponed ones here.)"""

from functools import lru_cache
from pathlib import Path

import warp as wp

TEXT = Path(__file__).with_name("chamfer.h")
wp.config.log_level = wp.LOG_ERROR
wp.config.enable_backward = False


@lru_cache
def chamfer_kernel(edges: int, samples: int, both: bool, lanes: int):
    """Compile chamfer.h for a mesh; Warp keeps the binary in its cache."""
    floats, integers = wp.array(dtype=wp.float32), wp.array(dtype=wp.int32)
    macros = {"EDGES": edges, "SAMPLES": samples, "BOTH": int(both), "CPU_LANES": lanes}
    defines = "".join(f"#define {name} {value}\n" for name, value in macros.items())
    text = "\n" + defines + TEXT.read_text() + "".join(f"#undef {name}\n" for name in macros)

    @wp.func_native(text)
    def distances(
        tid: int,
        line: floats,
        points: floats,
        frame_blocks: integers,
        frames: int,
        radius: float,
        rest_edges: floats,
        camera: wp.vec3,
        errors: floats,
    ): ...

    @wp.kernel(module="unique")
    def run(
        line: floats,
        points: floats,
        frame_blocks: integers,
        frames: int,
        radius: float,
        rest_edges: floats,
        camera: wp.vec3,
        errors: floats,
    ):
        distances(wp.tid(), line, points, frame_blocks, frames, radius, rest_edges, camera, errors)

    return run
