"""The chain of differential evolution, regions and CMA-ES on functions with known minima."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from pipeline.errors import UserError
from pipeline.identify.explore import explore
from pipeline.identify.history import History, theta_content
from pipeline.identify.refine import Solver, iterations
from pipeline.identify.regions import (
    Region,
    find_regions,
    load_regions,
    regularised,
    save_regions,
    suppress,
)
from tests.identify.toy import BUDGET, CENTRE, NAMES, budget, chain, correlated, quadratic


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_minimum_of_a_correlated_quadratic_is_found(seed: int) -> None:
    """Through a tenth of the box that fails; the refinement improves on the exploration."""
    evaluate = quadratic(CENTRE, correlated(), fails=lambda unit: unit[:, 4] > 0.9)
    explored, refined, _ = chain(evaluate, budget(seed=seed, cma_rollouts=1600))
    assert len(explored.total) == 24 * 13
    assert len(refined.total) == 1600
    assert np.isinf(explored.total).any()
    assert refined.best()["total"] - 1 < 1e-3 < explored.best()["total"] - 1
    np.testing.assert_allclose([refined.best()[f"unit_{n}"] for n in NAMES], CENTRE, atol=0.02)


def test_everything_evaluated_is_recorded_inside_the_box() -> None:
    """With the minimum in a corner, most candidates of CMA-ES fall outside and are reflected."""
    asked = []
    inner = quadratic(np.zeros(5), np.eye(5))

    def evaluate(unit):
        asked.append(unit)
        return inner(unit)

    explored, refined, regions = chain(evaluate)
    rows = np.concatenate([explored.unit, refined.unit])
    np.testing.assert_array_equal(rows, np.concatenate(asked))
    assert rows.min() >= 0
    assert rows.max() <= 1
    table = refined.table
    assert set(table["phase"].to_pylist()) == {"cma"}
    count = iterations(BUDGET, len(regions))
    assert table["generation"].to_pylist() == [g for g in range(count) for _ in range(40)]
    assert table["solver"].to_pylist()[:40] == [k for k in range(5) for _ in range(8)]


def test_exploration_starts_from_a_latin_hypercube_and_spends_its_budget() -> None:
    """Each of 24 strata of each parameter holds one agent; equal losses do not stop it early."""
    history = History("toy", NAMES)
    explore(quadratic(CENTRE, np.zeros((5, 5))), BUDGET, history)
    strata = np.sort(np.floor(history.unit[:24] * 24).astype(int), axis=0)
    np.testing.assert_array_equal(strata, np.tile(np.arange(24)[:, None], 5))
    generation = history.table["generation"].to_numpy()
    np.testing.assert_array_equal(generation, np.repeat(np.arange(13), 24))


def test_exploration_survives_a_box_that_fails_everywhere() -> None:
    history = History("toy", NAMES)
    explore(quadratic(CENTRE, np.eye(5), fails=lambda unit: unit[:, 0] >= 0), BUDGET, history)
    assert np.isinf(history.total).all()
    with pytest.raises(UserError, match="each of 312 simulations failed"):
        history.best()
    with pytest.raises(UserError, match="only 0 of 312"):
        find_regions(history.unit, history.total, k_top=5, k_nn=15, delta=0.1)


def test_the_same_seed_gives_the_same_bytes(tmp_path) -> None:
    """And another seed does not; NumPy's global generator has no part in it."""
    files = []
    for number, seed in enumerate((1, 1, 2)):
        np.random.seed(number)
        for phase, history in zip(
            "ab", chain(quadratic(CENTRE, correlated()), budget(seed=seed))[:2], strict=True
        ):
            history.save(tmp_path / f"{number}{phase}.parquet")
        files.append([(tmp_path / f"{number}{phase}.parquet").read_bytes() for phase in "ab"])
    assert files[0] == files[1]
    assert files[0][0] != files[2][0]
    assert files[0][1] != files[2][1]


def test_suppression_equals_its_definition() -> None:
    """Kept: the best row, and then every row further than delta from all kept better ones."""
    rng = np.random.default_rng(1)
    for _ in range(50):
        unit, total = rng.random((60, 3)), rng.random(60)
        left, expected = set(range(60)), []
        while left:
            best = min(left, key=lambda row: total[row])
            expected.append(best)
            left = {row for row in left if np.linalg.norm(unit[row] - unit[best]) > 0.4}
        assert suppress(unit, total, 0.4, 100) == expected
        assert suppress(unit, total, 0.4, 2) == expected[:2]
        assert all(np.linalg.norm(unit[i] - unit[j]) > 0.4 for i, j in combinations(expected, 2))


def test_covariance_is_that_of_the_nearest_successes() -> None:
    """Two clouds of known covariance; failed rows at the centres have no say."""
    rng = np.random.default_rng(1)
    factors = [
        np.diag([0.02, 0.01, 0.005]),
        np.array([[0.02, 0, 0], [0.015, 0.01, 0], [0, 0, 0.01]]),
    ]
    centres = np.array([[0.25, 0.25, 0.5], [0.75, 0.75, 0.5]])
    count = 4000
    clouds = [c + rng.normal(size=(count, 3)) @ f.T for c, f in zip(centres, factors, strict=True)]
    unit = np.concatenate([centres, *clouds, centres])
    near = np.linalg.norm(unit[:, None] - centres, axis=2).min(axis=1)
    total = near + np.where(unit[:, 0] > 0.5, 0.001, 0)
    total[-2:] = np.inf
    regions = find_regions(unit, total, k_top=3, k_nn=count + 1, delta=0.3)
    assert len(regions) == 2  # three were asked for, and there are no more
    for number, region in enumerate(regions):
        np.testing.assert_array_equal(region.mu, centres[number])
        assert region.members[0] == number
        assert region.loss == total[number]
        assert not set(region.members) & {len(unit) - 1, len(unit) - 2}
        expected = factors[number] @ factors[number].T
        np.testing.assert_allclose(region.sigma, expected, atol=0.06 * expected.max())


def test_covariance_is_positive_definite_whatever_the_neighbours() -> None:
    """One point many times over, a line, two points."""
    line = np.outer(np.linspace(0, 1, 9), np.ones(5))
    for points in (np.full((9, 5), 0.5), line, line[:2]):
        sigma = regularised(np.cov(points, rowvar=False))
        np.testing.assert_allclose(sigma, sigma.T)
        assert np.linalg.eigvalsh(sigma).min() > 0
        np.linalg.cholesky(sigma)


def test_regions_survive_the_file(tmp_path) -> None:
    region = Region(np.full(5, 0.1), np.eye(5) / 3, 1.25, [3, 1])
    save_regions(tmp_path / "a.json", NAMES, [region], 5)
    (loaded,) = load_regions(tmp_path / "a.json")
    np.testing.assert_array_equal(loaded.mu, region.mu)
    np.testing.assert_array_equal(loaded.sigma, region.sigma)
    assert (loaded.loss, loaded.members) == (1.25, [3, 1])


def test_first_candidates_follow_the_region() -> None:
    """They are mu + L z with z from N(0, I): mean mu, covariance Sigma."""
    factor = np.array([[0.04, 0, 0], [0.03, 0.02, 0], [0, -0.01, 0.03]])
    sigma = factor @ factor.T
    mu = np.array([0.4, 0.5, 0.6])
    asked = Solver(Region(mu, sigma, 1.0, []), population=4000, seed=3).ask()
    np.testing.assert_allclose(asked.mean(axis=0), mu, atol=0.003)
    np.testing.assert_allclose(np.cov(asked, rowvar=False), sigma, atol=1.5e-4)


def test_iterations_share_the_budget() -> None:
    assert iterations(BUDGET, 5) == 8
    assert iterations(BUDGET, 2) == 20


def test_theta_is_the_best_of_both_phases(tmp_path) -> None:
    explored, refined, _ = chain(quadratic(CENTRE, correlated()))
    explored.save(tmp_path / "a.parquet")
    refined.save(tmp_path / "b.parquet")
    for order, phase in (("ab", "cma"), ("aa", "de")):
        history = History.load("toy", NAMES, *(tmp_path / f"{name}.parquet" for name in order))
        content = theta_content(history, "band1")
        best = np.argmin(history.total)
        assert content["loss"]["total"] == history.total[best]
        np.testing.assert_array_equal(list(content["theta"].values()), 10 * history.unit[best])
        assert content["rollouts"] == len(history.total)
        assert (content["band"], content["method"]) == ("band1", "toy")
        assert content["found"]["phase"] == phase
        assert content["confidence"] is None
