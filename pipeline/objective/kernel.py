"""chamfer.h as a Warp kernel. (Warp reads annotations: no postponed ones here.)"""

from pathlib import Path

import warp as wp

from pipeline.base.native import built_once, text_of

TEXT = Path(__file__).with_name("chamfer.h")


@built_once
def chamfer_kernel(
    edges: int, samples: int, both: bool, lanes: int, culled: bool = True
) -> tuple[wp.Kernel, type]:
    """Compile chamfer.h for a mesh; Warp keeps the binary in its cache.

    Returns:
        The kernel, and the structure of arrays that it takes.
    """
    floats = wp.array(dtype=wp.float32)

    @wp.struct
    class CloudArrays:
        line: floats
        points: floats
        balls: floats
        frame_blocks: wp.array(dtype=wp.int32)
        frame_groups: wp.array(dtype=wp.int32)
        frames: int
        radius: float
        rest_edges: floats
        camera: wp.vec3
        errors: floats

    text = "".join(f"\nconst auto {name} = arrays.{name};" for name in CloudArrays.vars)
    macros = {"BOTH": int(both), "CULLED": int(culled), "CPU_LANES": lanes}
    text += text_of(TEXT, EDGES=edges, SAMPLES=samples, **macros)

    @wp.func_native(text)
    def distances(tid: int, arrays: CloudArrays): ...

    @wp.kernel(module="unique")
    def run(arrays: CloudArrays):
        distances(wp.tid(), arrays)

    return run, CloudArrays
