"""Differential evolution behind ask and tell is SciPy's, and leaves no thread behind."""

import gc
import threading
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import differential_evolution

from sling2sim2real.identification.optimizers.de.evolution import Evolution
from sling2sim2real.identification.search.evaluations import Evaluations
from sling2sim2real.identification.search.loop import latin_hypercube, search
from tests.identification.search.functions import NAMES, rosenbrock


def threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "differential evolution"]


def left() -> list[threading.Thread]:
    """Threads that do not end by themselves within a second."""
    gc.collect()
    end = time.monotonic() + 1
    while threads() and time.monotonic() < end:
        time.sleep(0.01)
    return threads()


@given(
    dimension=st.integers(1, 6),
    population=st.integers(5, 30),
    generations=st.integers(0, 12),
    seed=st.integers(0, 1000),
    recombination=st.floats(0, 1),
)
def test_its_points_are_those_of_scipy(
    dimension: int, population: int, generations: int, seed: int, recombination: float
) -> None:
    """To the last bit, from the same first population and generator."""
    expected = []

    def objective(unit: np.ndarray) -> np.ndarray:
        expected.append(unit.T.copy())
        return ((unit.T - 0.3) ** 2).sum(axis=1)

    shared = {"mutation": (0.4, 0.9), "recombination": recombination}
    differential_evolution(
        objective,
        [(0, 1)] * dimension,
        strategy="best1bin",
        init=latin_hypercube(dimension, population, seed),
        rng=np.random.default_rng([seed, 1]),
        maxiter=generations,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0,
        atol=-1,
        **shared,
    )
    rollouts = population * (generations + 1)
    optimizer = Evolution(dimension, rollouts=rollouts, seed=seed, population=population, **shared)
    for unit in expected:
        requested = optimizer.ask()
        np.testing.assert_array_equal(requested, unit)
        optimizer.tell(((requested - 0.3) ** 2).sum(axis=1))


def small(population: int = 5, **more) -> Evolution:
    return Evolution(2, rollouts=15, seed=1, population=population, **more)


def test_no_thread_is_left() -> None:
    """Dropped before it was asked, in the middle, and after its budget."""
    for summary in (0, 1, 3):
        optimizer = small()
        for _ in range(summary):
            optimizer.tell(rosenbrock(optimizer.ask()))
        assert threads()
        del optimizer
        assert not left()


@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt])
def test_a_failing_evaluation_surfaces_and_leaves_no_thread(error: type[BaseException]) -> None:
    def broken(unit: np.ndarray):
        raise error

    with pytest.raises(error):
        search(small(), broken, Evaluations("toy", NAMES[:2]), rollouts=15)
    assert not left()


def test_what_scipy_raises_surfaces() -> None:
    with pytest.raises(ValueError, match="mutation"):
        small(mutation=(0.5, 7.0))
    with pytest.raises(ValueError, match="population supplied"):
        small(population=3).ask()
    optimizer = small()
    for _ in range(4):
        optimizer.tell(rosenbrock(optimizer.ask()))
    with pytest.raises(RuntimeError, match="beyond its budget"):
        optimizer.ask()
    assert not left()
