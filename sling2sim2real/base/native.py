"""Kernels whose body is native text: one thread at a time builds, compiles and loads them."""

from __future__ import annotations

import ctypes
import os
import re
import sys
import tempfile
from collections.abc import Callable, Hashable
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar

import warp as wp

from sling2sim2real.base import home

wp.config.log_level = wp.LOG_ERROR
wp.config.enable_backward = False
# The CPU's own vectors, but no fused multiply-add: with lanes of a fixed number and no function of
# the C library but the root, every x86-64 CPU gives the same bits.
wp.config.cpu_compiler_flags = f"{wp.config.cpu_compiler_flags or ''} -ffp-contract=off"
_one_at_a_time = Lock()
Built = TypeVar("Built")
DRIVERS = "libcuda.so", "libcuda.so.1"  # as Warp looks for them


@cache
def start() -> None:
    """Start Warp, without its warning on a machine that has no CUDA driver.

    `machine.named` refuses a GPU there. The warning is a line of native code.
    """
    home.settle()
    if any(map(_loads, DRIVERS)):
        wp.init()
        return
    sys.stderr.flush()
    with tempfile.TemporaryFile() as message:
        stderr = os.dup(2)
        os.dup2(message.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
            message.seek(0)
            for line in message:
                if not line.startswith(b"Warp CUDA warning: Could not find or load"):
                    os.write(2, line)


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def text_of(*paths: Path, arrays: type, **macros: object) -> str:
    """Native text of some files after macros, in which the fields of `arrays` are names.

    No macro is defined beyond it.
    """
    text = "".join(f"\nconst auto {field} = arrays.{field};" for field in arrays.vars)
    text += "\n" + "".join(f"#define {name} {value}\n" for name, value in macros.items())
    text += "".join(path.read_text(encoding="utf-8") for path in paths)
    names = sorted(set(re.findall(r"^#define (\w+)", text, re.MULTILINE)))
    return text + "\n" + "".join(f"#undef {name}\n" for name in names)


def built_once(build: Callable[..., Built]) -> Callable[..., Built]:
    """`functools.cache` for functions that make a kernel, safe to call from several threads."""
    once = cache(build)

    def built(*key: Hashable) -> Built:
        with _one_at_a_time:
            start()  # two threads that start Warp at once would undo each other's modules
            return once(*key)

    return built


def empty(size: int | tuple[int, ...], dtype: Any, device: str) -> wp.array:
    """An array for results there."""
    return wp.empty(size, dtype=dtype, device=device)


def run_kernel(kernel: wp.Kernel, blocks: int, inputs: list, device: str) -> None:
    """Run blocks: each is one thread of SIMD vectors on the CPU, a warp of 32 threads on CUDA."""
    threads = 32 if device.startswith("cuda") else 1
    run_threads(kernel, blocks * threads, inputs, device, block=threads)


def run_threads(
    kernel: wp.Kernel, dim: int | tuple[int, ...], inputs: list, device: str, block: int = 256
) -> None:
    """Run a thread for each index, on CUDA `block` of them together."""
    block = block if device.startswith("cuda") else 1
    with _one_at_a_time:  # Warp's cache has one binary for each number of threads a block
        kernel.module.load(device, block)
    wp.launch(kernel, dim=dim, inputs=inputs, device=device, block_dim=block)
