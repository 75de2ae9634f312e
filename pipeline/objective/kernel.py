"""chamfer.h as a Warp kernel. (Warp reads annotations: no postponed ones here.)"""

from pathlib import Path

import warp as wp

from pipeline.base.native import built_once, text_of

TEXT = Path(__file__).with_name("chamfer.h")


@built_once
def chamfer_kernel(edges: int, samples: int, both: bool, lanes: int):
    """Compile chamfer.h for a mesh; Warp keeps the binary in its cache."""
    floats, integers = wp.array(dtype=wp.float32), wp.array(dtype=wp.int32)
    text = text_of(TEXT, EDGES=edges, SAMPLES=samples, BOTH=int(both), CPU_LANES=lanes)

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
