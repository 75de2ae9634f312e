"""chamfer.h and terms.h as Warp kernels. (Warp reads annotations: no postponed ones here.)"""

from pathlib import Path

import warp as wp

from pipeline.base.native import built_once, text_of


@built_once
def chamfer_kernel(
    edges: int, samples: int, both: bool, lanes: int, culled: bool = True
) -> tuple[wp.Kernel, type]:
    """Compile chamfer.h for a mesh; Warp keeps the binary in its cache.

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

    macros = {"BOTH": int(both), "CULLED": int(culled), "CPU_LANES": lanes}
    path = Path(__file__).with_name("chamfer.h")
    text = text_of(path, arrays=CloudArrays, EDGES=edges, SAMPLES=samples, **macros)

    @wp.func_native(text)
    def distances(tid: int, arrays: CloudArrays): ...

    @wp.kernel(module="unique")
    def run(arrays: CloudArrays):
        distances(wp.tid(), arrays)

    return run, CloudArrays


@built_once
def terms_kernel(window: int) -> tuple[wp.Kernel, type]:
    """Compile terms.h for a median of so many samples; as `chamfer_kernel`."""
    doubles, integers = wp.array(dtype=wp.float64), wp.array(dtype=wp.int32)

    @wp.struct
    class TermArrays:
        force: wp.array3d(dtype=wp.float32)
        first: integers
        columns: integers
        values: doubles
        measured: doubles
        velocity: doubles
        samples: int
        sample_weights: doubles
        errors: wp.array(dtype=wp.float32)
        both: int
        frames: int
        frame_weights: doubles
        filtered: doubles
        terms: doubles

    path = Path(__file__).with_name("terms.h")

    @wp.func_native(text_of(path, arrays=TermArrays, WINDOW=window))
    def reduced(tid: int, arrays: TermArrays): ...

    @wp.kernel(module="unique")
    def run(arrays: TermArrays):
        reduced(wp.tid(), arrays)

    return run, TermArrays
