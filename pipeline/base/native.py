"""Kernels whose body is native text: one thread at a time builds, compiles and loads them."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from threading import Lock

import warp as wp

wp.config.log_level = wp.LOG_ERROR
wp.config.enable_backward = False
_one_at_a_time = Lock()


def text_of(*paths: Path, **macros) -> str:
    """Native text of some files after macros; none of theirs is defined beyond it."""
    text = "\n" + "".join(f"#define {name} {value}\n" for name, value in macros.items())
    text += "".join(path.read_text(encoding="utf-8") for path in paths)
    names = sorted(set(re.findall(r"^#define (\w+)", text, re.MULTILINE)))
    return text + "\n" + "".join(f"#undef {name}\n" for name in names)


def built_once(build: Callable[..., wp.Kernel]) -> Callable[..., wp.Kernel]:
    """`functools.cache` for functions that make a kernel, safe to call from several threads."""
    build = cache(build)

    def built(*key) -> wp.Kernel:
        with _one_at_a_time:
            wp.init()  # two threads that start Warp at once would undo each other's modules
            return build(*key)

    return built


def launch(kernel: wp.Kernel, blocks: int, inputs: list, device: str) -> None:
    """Run blocks: each is one thread of SIMD vectors on the CPU, a warp of 32 threads on CUDA."""
    threads = 32 if device.startswith("cuda") else 1
    with _one_at_a_time:  # Warp's cache has one binary for each number of threads a block
        kernel.module.load(device, threads)
    wp.launch(kernel, dim=blocks * threads, inputs=inputs, device=device, block_dim=threads)
