"""Bayesian optimisation on functions with known minima, against random points and closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import norm

from sling2sim2real.identification.searches.bo import greedy, standardised
from tests.identification.searches.functions import (
    CENTRE,
    NAMES,
    Evaluate,
    alone,
    changed,
    correlated,
    quadratic,
)
from tests.project import python

POPULATION = 12


def branin(unit: np.ndarray) -> np.ndarray:
    """Three equal minima, 0.397887 (Dixon and Szegö 1978)."""
    x, y = 15 * unit[:, 0] - 5, 15 * unit[:, 1]
    bowl = (y - 5.1 / (4 * np.pi**2) * x**2 + 5 / np.pi * x - 6) ** 2
    return bowl + 10 * (1 - 1 / (8 * np.pi)) * np.cos(x) + 10


def random_points(count: int, dimension: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((count, dimension))


def test_it_beats_random_points() -> None:
    """By bounds that it keeps with any seed: another CPU's rounding is like another seed."""
    optimizer = changed(seed=2, population=POPULATION)
    evaluations = alone("bo", Evaluate(branin, NAMES[:2]), 96, optimizer, NAMES[:2])
    assert len(evaluations.total) == 96
    assert 0.397887 <= evaluations.total.min() < 0.397887 + 0.02
    for other in range(10):
        assert evaluations.total.min() < branin(random_points(96, 2, other)).min()


def test_it_goes_round_a_part_that_fails() -> None:
    """A valley of two pairs that trade off, beside failures that fill more than half of the box."""
    evaluate = quadratic(CENTRE, correlated(), fails=lambda unit: unit[:, 3] < 0.6)
    random = [evaluate(random_points(120, 5, other)).total.min() for other in range(10)]
    evaluations = alone("bo", evaluate, 120, changed(population=20))
    assert np.isinf(evaluations.total[:20]).any()
    assert np.isinf(evaluations.total[-60:]).mean() < 0.1
    assert evaluations.total.min() - 1 < (np.median(random) - 1) / 3


@pytest.mark.slow
def test_it_is_silent_and_torch_waits_until_it_is_asked_for() -> None:
    """Though losses are all alike, points need a jitter, and climbs stop after a few steps."""
    code = """
import sys, numpy as np
import sling2sim2real.identification.searches.bo
import sling2sim2real.identification.searches.adam
from tests.identification.searches.functions import NAMES, Evaluate, alone, changed

assert not {"torch", "botorch"} & set(sys.modules)
for function in (lambda unit: np.ones(len(unit)), lambda unit: (unit[:, 0] - 0.3) ** 2):
    evaluations = alone("bo", Evaluate(function, NAMES[:1]), 30, changed(population=10), NAMES[:1])
    print(len(np.unique(evaluations.unit, axis=0)))
"""
    done = python("-c", code)
    assert (done.returncode, done.stderr) == (0, "")
    assert min(map(int, done.stdout.split())) > 20


def test_greedy_takes_what_adds_most() -> None:
    """Against the definition, over all that is left; and the first by EI's closed form."""
    rng = np.random.default_rng(1)
    samples = rng.normal(size=(40, 12))
    chosen = greedy(samples, 0.3, 5)
    reached = np.full(40, 0.3)
    for place, candidate in enumerate(chosen):
        left = [index for index in range(12) if index not in chosen[:place]]
        gains = {index: np.maximum(samples[:, index], reached).mean() for index in left}
        assert candidate == max(gains, key=gains.get)
        reached = np.maximum(reached, samples[:, candidate])
    mean, deviation, best = np.array([0.0, 0.4, 0.2]), np.array([1.0, 0.3, 0.6]), 0.5
    z = (mean - best) / deviation
    expected = (mean - best) * norm.cdf(z) + deviation * norm.pdf(z)
    samples = mean + deviation * rng.normal(size=(100_000, 3))
    assert greedy(samples, best, 1) == [int(expected.argmax())]


@given(
    loss=arrays(float, st.integers(2, 40), elements=st.floats(-1e3, 1e3)),
    outlier=st.floats(1e7, 1e12),
)
def test_neither_units_nor_the_size_of_an_outlier_matter(loss, outlier: float) -> None:
    """An outlier counts no more than a bad loss, however huge it is."""
    loss = loss.round(9)  # of differences near 1e-160 the squares are no numbers any more
    summary = standardised(np.append(loss, outlier))
    np.testing.assert_allclose(summary, standardised(np.append(loss, 10 * outlier)), atol=1e-9)
    assert abs(summary.mean()) < 1e-9
    assert summary.std(ddof=1) == pytest.approx(1) or np.ptp(summary) < 1e-9
    loss = np.random.default_rng(1).lognormal(0, 3, 50)
    np.testing.assert_allclose(standardised(7 * loss - 3), standardised(loss), atol=1e-12)
