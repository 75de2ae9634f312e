"""Differential evolution is SciPy's, with nothing between."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize

from sling2sim2real.identification.objective.box import latin_hypercube
from sling2sim2real.identification.searches.de import differential_evolution
from tests.identification.searches.functions import batches_of


def bowl(unit: np.ndarray) -> np.ndarray:
    return ((unit - 0.3) ** 2).sum(axis=1)


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
        return bowl(unit.T)

    shared = {"mutation": (0.4, 0.9), "recombination": recombination}
    optimize.differential_evolution(
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
    budget = {"rollouts": population * (generations + 1), "seed": seed, "population": population}
    found = batches_of(differential_evolution, bowl, dimension, **budget, **shared)
    np.testing.assert_array_equal(np.stack(found), np.stack(expected))
