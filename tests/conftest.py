"""What all tests share."""

import gc
import os
import signal
import sys

import pytest
from hypothesis import settings

from pipeline.params import Params, load
from tests.project import DEFAULTS

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as stages have it; nothing has imported NumPy yet


# Hypothesis measures no time, for other programs have their share of it; the same examples each
# time, for what fails on one machine should fail on another.
settings.register_profile("quick", deadline=None, derandomize=True, max_examples=20)
settings.register_profile("thorough", deadline=None, derandomize=True, max_examples=200)


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Python looks for garbage the longer the more there is; what is imported is none."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_configure() -> None:
    """What a script starts in its background ignores Ctrl-C, and so would all that tests start.

    Hundreds of processes import the same modules: they are compiled once, whatever the environment
    says.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="module")
def nowhere(tmp_path_factory):
    """Work in an empty folder: what `make run` has left in the project must not matter."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("nowhere"))
        yield


@pytest.fixture(scope="session")
def params() -> Params:
    return load(DEFAULTS)


@pytest.fixture(scope="session")
def sling(params: Params):
    """The first band of the rig, as params.yaml mounts it."""
    from sling2sim2real.simulator.model import ClampedBand

    return ClampedBand.of(params.bands["band1"], params.setup, params.sling)


@pytest.fixture(scope="session")
def bench(params: Params):
    """Where checks of `sling verify` run."""
    from validation.simulator.finding import Bench

    return Bench(params)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests come first, so that the processes which share them end together."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    longest = "test_pipeline.py"
    items.sort(key=lambda item: (item.path.name != longest, item.path not in slow))
