"""The texts of this folder as Warp kernels. (Warp reads annotations: no postponed ones here.)"""

# Warp's annotations are values, and what its decorators give is no function any more:
# pyright: reportInvalidTypeForm=false, reportGeneralTypeIssues=false, reportReturnType=false
# pyright: reportArgumentType=false

import math
from pathlib import Path

import warp as wp

from sling2sim2real.base.native import built_once, text_of


@built_once
def chamfer_kernel(
    edges: int, samples: int, lanes: int, culled: bool = True
) -> tuple[wp.Kernel, type]:
    """Compile chamfer.h for a mesh; Warp keeps the binary in its cache.

    Returns:
        The kernel, and the structure of arrays that it takes.
    """
    macros = {"EDGES": edges, "SAMPLES": samples, "CULLED": int(culled), "CPU_LANES": lanes}
    return _cloud_kernel("chamfer.h", **macros)


@built_once
def clouds_kernel(
    edges: int, rings: int, around: int, lanes: int, culled: bool = True
) -> tuple[wp.Kernel, type]:
    """Compile clouds.h for a mesh; as `chamfer_kernel`."""
    angles = [2 * math.pi * k / around for k in range(around)]
    macros: dict[str, int | str] = {"RINGS": rings, "AROUND": around}
    for name, turn in (("COSINES", math.cos), ("SINES", math.sin)):
        macros[name] = "{" + ", ".join(f"{turn(angle):.9f}f" for angle in angles) + "}"
    return _cloud_kernel("clouds.h", EDGES=edges, CULLED=int(culled), CPU_LANES=lanes, **macros)


def _cloud_kernel(file: str, **macros: int | str) -> tuple[wp.Kernel, type]:
    """Make a kernel of points.h and a text after it, and the type of the arrays, for `Chamfer`."""
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

    paths = (Path(__file__).with_name(name) for name in ("points.h", file))
    text = text_of(*paths, arrays=CloudArrays, **macros)

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
