"""The guard around Warp, which is not made for several threads at its start, and its compiler."""

import pytest

from tests.project import python

STARTED_TWICE = """
import time
from concurrent.futures import ThreadPoolExecutor
import warp._src.context as context
from sling2sim2real.identification.objective.kernels import chamfer_kernel

starts, runtime = [], context.Runtime

def slow(*args):
    starts.append(1)
    time.sleep(1.0)
    return runtime(*args)

context.Runtime = slow
with ThreadPoolExecutor(2) as pool:
    list(pool.map(lambda edges: chamfer_kernel("tube", edges, 4), (4, 6)))
print(len(starts))
"""
SOMETHING_ELSE = """
import os
from sling2sim2real.base import native

start = native.wp.init
native.wp.init = lambda: (start(), os.write(2, b"something else\\n"))
native.start()
"""
SIMULATED = """
import hashlib, sys
import numpy as np
from sling2sim2real.base.native import wp
from sling2sim2real.identification.objective.loss import EpisodeLoss
from pipeline.params import load
from sling2sim2real.simulator.interaction import interact
from sling2sim2real.simulator.launch import launch
from sling2sim2real.simulator.model import LaunchSetup
from sling2sim2real.simulator.parameters import Parameters
from validation.projects import DEFAULTS
from validation.synthetic import THETA, recorded_yardstick

wp.config.cpu_compiler_flags = wp.config.cpu_compiler_flags.replace("-march=native", sys.argv[1])
params = load(DEFAULTS)
sling, episode = recorded_yardstick(params)
thetas = Parameters.of(sling.law, np.array([THETA, THETA]) * [[0.8], [1.1]])
rollouts = interact(sling, episode, thetas)
losses = EpisodeLoss.of(params, "paper", episode, sling).terms(rollouts)
setup = LaunchSetup.of(params.setup, params.sling)
shots = launch(sling, setup, thetas, draws=np.array([[-0.35, -0.15]]))
numbers = [rollouts.force, rollouts.center_line, *losses.values(), *vars(shots).values()]
for array in numbers:
    print(hashlib.sha256(np.asarray(array, float).tobytes()).hexdigest())
"""


def test_warp_starts_once_whoever_comes_first() -> None:
    assert python("-c", STARTED_TWICE).stdout.split()[-1] == "1"


def test_a_start_without_a_cuda_driver_is_silent_and_hides_nothing_else() -> None:
    done = python("-c", SOMETHING_ELSE)
    assert (done.stdout, done.stderr) == ("", "something else\n")


@pytest.mark.slow
def test_results_are_the_same_on_every_x86_64_cpu() -> None:
    """With this one's vectors, and with the least that there are, without a fused multiply-add."""
    targets = ("-march=native", "-target-cpu x86-64-v2")
    native, least = (python("-c", SIMULATED, target) for target in targets)
    assert len(native.stdout.split()) > 10
    assert least.stdout == native.stdout
