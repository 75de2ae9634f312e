"""CMA-ES side by side: where it starts, who asked, and that it leaves other generators alone."""

import os

import numpy as np

from sling2sim2real.identification.optimizers.cma.multistart import Multistart, Solver
from sling2sim2real.identification.search.evaluations import Evaluations
from sling2sim2real.identification.search.loop import search
from sling2sim2real.identification.search.regions import Region
from tests.identification.search.functions import (
    CENTRE,
    Evaluate,
    correlated,
    quadratic,
    rosenbrock,
)

NAMES = ("a", "b", "c")


def test_first_candidates_follow_the_region() -> None:
    """They are mu + L z with z from N(0, I): mean mu, covariance Sigma."""
    factor = np.array([[0.04, 0, 0], [0.03, 0.02, 0], [0, -0.01, 0.03]])
    sigma = factor @ factor.T
    mu = np.array([0.4, 0.5, 0.6])
    requested = Solver(Region(mu, sigma, 1.0, []), population=4000, seed=3).ask()
    np.testing.assert_allclose(requested.mean(axis=0), mu, atol=0.003)
    np.testing.assert_allclose(np.cov(requested, rowvar=False), sigma, atol=1.5e-4)


def balls(*centres: float, size: float = 0.01, dimension: int = 3) -> list[Region]:
    sigma = size * np.eye(dimension)
    return [Region(np.full(dimension, centre), sigma, 1.0, []) for centre in centres]


def test_all_solvers_ask_as_one_batch_and_learn_their_own_losses() -> None:
    """Two solvers side by side do what each of them does alone, with the same losses."""
    both = Multistart(balls(0.3, 0.7), population=6, seed=5)
    seeds = np.random.SeedSequence(5).generate_state(2)
    single = [
        Solver(region, 6, int(seed)) for region, seed in zip(balls(0.3, 0.7), seeds, strict=True)
    ]
    np.testing.assert_array_equal(both.owner, np.repeat([0, 1], 6))
    for _ in range(5):
        unit = both.ask()
        parts = [solver.ask() for solver in single]
        np.testing.assert_array_equal(unit, np.concatenate(parts))
        both.tell(rosenbrock(unit))
        for solver, part in zip(single, parts, strict=True):
            solver.tell(rosenbrock(part))


def searched(
    regions: list[Region], evaluate: Evaluate, rollouts: int, population: int
) -> Evaluations:
    evaluations = Evaluations("toy", evaluate.box.names)
    search(
        Multistart(regions, population=population, seed=1), evaluate, evaluations, rollouts=rollouts
    )
    return evaluations


def test_the_budget_is_spent_whatever_the_number_of_solvers() -> None:
    for rollouts in (1, 15, 16, 17, 100):
        table = searched(balls(0.3, 0.7), Evaluate(rosenbrock, NAMES), rollouts, population=8).table
        owner = np.tile(np.repeat([0, 1], 8), 7)[:rollouts]
        assert table["solver"].to_pylist() == owner.tolist()
        assert table["generation"].to_pylist() == [row // 16 for row in range(rollouts)]


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
