"""CMA-ES side by side: where it starts, who asked, and that it leaves other generators alone."""

import os

import numpy as np

from sling2sim2real.identification.results.evaluations import Evaluations
from sling2sim2real.identification.search import run
from sling2sim2real.identification.searches.cma_es import cma_es
from sling2sim2real.identification.searches.regions import Region
from tests.identification.searches.functions import (
    CENTRE,
    Evaluate,
    correlated,
    quadratic,
    rosenbrock,
)

NAMES = ("a", "b", "c")


def searched(
    regions: list[Region], evaluate: Evaluate, rollouts: int, population: int, seed: int = 1
) -> Evaluations:
    evaluations, box = Evaluations("toy", evaluate.box.names), evaluate.box
    search = lambda losses_of: cma_es(losses_of, regions, population=population, seed=seed)  # noqa: E731
    run(search, evaluate, evaluations, phase="cma", rollouts=rollouts, box=box)
    return evaluations


def balls(*centres: float, size: float = 0.01, dimension: int = 3) -> list[Region]:
    sigma = size * np.eye(dimension)
    return [Region(np.full(dimension, centre), sigma, 1.0, []) for centre in centres]


def test_first_candidates_follow_the_region() -> None:
    """They are mu + L z with z from N(0, I): mean mu, covariance Sigma."""
    factor = np.array([[0.04, 0, 0], [0.03, 0.02, 0], [0, -0.01, 0.03]])
    sigma = factor @ factor.T
    mu = np.array([0.4, 0.5, 0.6])
    region = Region(mu, sigma, 1.0, [])
    unit = searched([region], Evaluate(rosenbrock, NAMES), 4000, population=4000, seed=3).unit
    np.testing.assert_allclose(unit.mean(axis=0), mu, atol=0.003)
    np.testing.assert_allclose(np.cov(unit, rowvar=False), sigma, atol=1.5e-4)


def test_solvers_side_by_side_learn_their_own_losses() -> None:
    """The first of two does what it does alone: the other's losses change nothing."""
    evaluate = Evaluate(rosenbrock, NAMES)
    both = searched(balls(0.3, 0.7), evaluate, 60, population=6, seed=5)
    other = searched(balls(0.3, 0.2), evaluate, 60, population=6, seed=5)
    first = np.array(both.table["solver"]) == 0
    np.testing.assert_array_equal(both.unit[first], other.unit[first])
    assert not np.array_equal(both.unit[~first], other.unit[~first])


def test_it_goes_on_where_nothing_is_left_to_gain() -> None:
    """After convergence, and on a plain, CMA-ES asks on for points of the cube."""
    for matrix in (correlated(), np.zeros((5, 5))):
        evaluate, regions = quadratic(CENTRE, matrix), balls(0.4, dimension=5)
        total = searched(regions, evaluate, 4000, population=8).total
        assert len(total) == 4000 and total.min() - 1 < 1e-8


def test_numpys_generator_and_the_folder_are_left_alone(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.random.seed(3)
    expected = np.random.RandomState(3).random()
    searched(balls(0.5), Evaluate(rosenbrock, NAMES), 80, population=8)
    assert np.random.random() == expected
    assert not os.listdir(tmp_path)
