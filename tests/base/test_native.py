"""The guard around Warp, which is not made for several threads at its start."""

from __future__ import annotations

import subprocess
import sys

STARTED_TWICE = """
import time
from concurrent.futures import ThreadPoolExecutor
import warp._src.context as context
from pipeline.objective.kernel import chamfer_kernel

starts, runtime = [], context.Runtime

def slow(*args):
    starts.append(1)
    time.sleep(1.0)
    return runtime(*args)

context.Runtime = slow
with ThreadPoolExecutor(2) as pool:
    list(pool.map(lambda edges: chamfer_kernel(edges, 4, 1, 4), (4, 6)))
print(len(starts))
"""


def test_warp_starts_once_whoever_comes_first() -> None:
    done = subprocess.run(
        [sys.executable, "-c", STARTED_TWICE], capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[-1] == "1"


def test_a_start_without_a_cuda_driver_is_silent_and_hides_nothing_else() -> None:
    code = """
import os
from pipeline.base import native

start = native.wp.init
native.wp.init = lambda: (start(), os.write(2, b"something else\\n"))
native.start()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "something else\n")
