"""The loop around optimisers, and the whole chain, on functions with known minima."""

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.search.build import build
from sling2sim2real.identification.search.evaluations import Evaluations, theta_content
from sling2sim2real.identification.search.explore import rollouts_of
from sling2sim2real.identification.search.loop import latin_hypercube, search
from tests.identification.search import functions
from tests.identification.search.functions import (
    CENTRE,
    NAMES,
    Evaluate,
    alone,
    chain,
    changed,
    quadratic,
)
from tests.project import DEFAULTS

VALLEY = functions.correlated()


def test_the_minimum_of_a_correlated_quadratic_is_found() -> None:
    """Through a tenth of the box that fails; the refinement improves on the exploration."""
    evaluate = quadratic(CENTRE, VALLEY, fails=lambda unit: unit[:, 4] > 0.9)
    for seed in (1, 2, 3):
        explored, refined, _ = chain(evaluate, changed(seed=seed, cma_rollouts=1600))
        assert (len(explored.total), len(refined.total)) == (24 * 13, 1600)
        assert np.isinf(explored.total).any()
        best = refined.best_row()
        assert best["total"] - 1 < 1e-3 < explored.best_row()["total"] - 1
        np.testing.assert_allclose([best[f"unit_{n}"] for n in NAMES], CENTRE, atol=0.02)


def test_everything_evaluated_is_recorded_inside_the_box() -> None:
    """With the minimum in a corner, most candidates of CMA-ES fall outside and are reflected."""
    requested = []
    inner = quadratic(np.zeros(5), np.eye(5))
    explored, refined, regions = chain(lambda unit: (requested.append(unit), inner(unit))[1])
    rows = np.concatenate([explored.unit, refined.unit])
    np.testing.assert_array_equal(rows, np.concatenate(requested))
    assert rows.min() >= 0 and rows.max() <= 1
    columns = refined.table.to_pydict()
    assert set(columns["phase"]) == {"cma"} and len(regions) == 5
    assert columns["generation"] == [g for g in range(8) for _ in range(40)]
    assert columns["solver"][:40] == [k for k in range(5) for _ in range(8)]


def test_a_box_that_fails_everywhere_is_searched_to_the_end() -> None:
    """An optimiser gets finite losses even so; only then the failure is said."""
    evaluate = quadratic(CENTRE, np.eye(5), fails=lambda unit: unit[:, 0] >= 0)
    for name in (
        "de",
        "tests.identification.search.own:RandomSearch",
    ):  # which looks at what it gets
        evaluations = alone(name, evaluate, 312)
        assert np.isinf(evaluations.total).all()
        with pytest.raises(UserError, match="each of 312 simulations failed"):
            evaluations.best_row()


class Recorder:
    """Asks for batches of sizes that were given, and keeps the losses that it gets."""

    phase = "recorder"

    def __init__(self, *sizes: int) -> None:
        self._sizes, self.summary = iter(sizes), []

    def ask(self) -> np.ndarray:
        return np.full((next(self._sizes), 5), 0.5)

    def tell(self, losses: np.ndarray) -> None:
        self.summary.append(losses)


@given(sizes=st.lists(st.integers(1, 9), min_size=1, max_size=9), data=st.data())
def test_exactly_the_budget_is_spent(sizes: list[int], data: st.DataObject) -> None:
    """Whatever sizes are asked for; the losses of the batch that is cut are not given."""
    rollouts = data.draw(st.integers(1, sum(sizes)))
    recorder, evaluations = Recorder(*sizes), Evaluations("toy", NAMES)
    search(recorder, quadratic(CENTRE, np.eye(5)), evaluations, rollouts=rollouts)
    assert len(evaluations.total) == rollouts
    whole = [size for size, end in zip(sizes, np.cumsum(sizes), strict=True) if end <= rollouts]
    assert [len(losses) for losses in recorder.summary] == whole
    generation = np.repeat(np.arange(len(sizes)), sizes)[:rollouts]
    assert evaluations.table["generation"].to_pylist() == generation.tolist()


def test_failed_points_are_told_as_twice_the_worst_so_far() -> None:
    values = iter([np.array([1.0, np.inf, 3.0]), np.array([2.0, np.inf]), np.array([4.0, np.inf])])
    evaluate = Evaluate(lambda unit: next(values), fails=lambda unit: np.arange(len(unit)) == 1)
    recorder = Recorder(3, 2, 2)
    search(recorder, evaluate, Evaluations("toy", NAMES), rollouts=7)
    assert [losses.tolist() for losses in recorder.summary] == [
        [1.0, 6.0, 3.0],
        [2.0, 6.0],
        [4.0, 8.0],
    ]


def test_fixed_axes_keep_their_physical_values() -> None:
    """The optimiser searches the other axes; the evaluations have all of them."""
    parameters = load(DEFAULTS).parameters
    fixed = {"poissons_ratio": 0.45, "elasticity_damping": 5e-3}
    box = SearchBox.of(parameters, fixed=fixed)
    assert box.free == ("youngs_modulus", "dynamic_friction", "damping_scale")
    evaluate = quadratic(CENTRE, np.eye(5))
    evaluate.box = box
    evaluations = Evaluations("toy", box.names)
    optimizer = build("de", 3, rollouts=600, seed=1, population=20)
    search(optimizer, evaluate, evaluations, rollouts=600, box=box)
    np.testing.assert_allclose(evaluations.table["poissons_ratio"], 0.45, rtol=1e-12)
    np.testing.assert_allclose(evaluations.table["elasticity_damping"], 5e-3, rtol=1e-12)
    best = [evaluations.best_row()[f"unit_{name}"] for name in box.free]
    np.testing.assert_allclose(best, CENTRE[[0, 3, 4]], atol=1e-3)


@pytest.mark.slow
def test_one_free_axis_is_enough() -> None:
    evaluate = quadratic(CENTRE[:1], np.eye(1), names=NAMES[:1])
    budget = changed(population=10, generations=5, k_nn=6, k_top=2, cma_rollouts=64)
    searches = [alone(name, evaluate, 124, budget, NAMES[:1]) for name in ("de", "bo", "adam")]
    for evaluations in (*searches, chain(evaluate, budget, NAMES[:1])[1]):
        assert abs(evaluations.best_row()["unit_a"] - CENTRE[0]) < 0.02


def test_every_search_has_the_same_budget() -> None:
    params = load(DEFAULTS)
    optimizer, explore = params.optimizer, rollouts_of(params, "sling2sim2real")
    assert explore == optimizer.population * (optimizer.generations + 1)
    assert rollouts_of(params, "bo") == explore + optimizer.cma_rollouts == 600


@pytest.fixture
def torch_threads():
    before = torch.get_num_threads()
    yield torch.set_num_threads
    torch.set_num_threads(before)


@pytest.mark.slow
def test_an_optimiser_is_deterministic_and_spends_its_budget(torch_threads) -> None:
    """Whatever the threads and global generators, which it leaves alone.

    It starts, if it is ours, from the common Latin hypercube.
    """
    for name in ("de", "bo", "adam", "tests.identification.search.own:RandomSearch"):
        runs = []
        for number, seed in enumerate((1, 1, 2)):
            np.random.seed(number), torch.manual_seed(number), torch_threads(1 + number)
            states = np.random.get_state()[1].copy(), torch.random.get_rng_state()
            optimizer = changed(seed=seed, population=8)
            runs.append(alone(name, quadratic(CENTRE, VALLEY), 29, optimizer))
            np.testing.assert_array_equal(np.random.get_state()[1], states[0])
            assert torch.equal(torch.random.get_rng_state(), states[1])
            assert torch.get_num_threads() == 1 + number
            assert len(runs[-1].total) == 29
            assert runs[-1].unit.min() >= 0 and runs[-1].unit.max() <= 1
        assert runs[0].table.equals(runs[1].table)
        assert not runs[0].table.equals(runs[2].table)
        if ":" not in name:
            assert set(runs[0].table["phase"].to_pylist()) == {name}
            np.testing.assert_array_equal(runs[0].unit[:8], latin_hypercube(5, 8, 1))


def test_a_history_without_rows_can_be_kept(tmp_path: Path) -> None:
    """What a search of one phase leaves for the second one: the same columns."""
    empty, full = Evaluations("toy", NAMES), alone("de", quadratic(CENTRE, np.eye(5)), 30)
    empty.save(tmp_path / "empty.parquet")
    full.save(tmp_path / "full.parquet")
    loaded = Evaluations.load("toy", NAMES, tmp_path / "full.parquet", tmp_path / "empty.parquet")
    assert loaded.table.equals(full.table)
    assert len(Evaluations.load("toy", NAMES, tmp_path / "empty.parquet").total) == 0


def test_theta_is_the_best_of_both_phases(tmp_path) -> None:
    paths = tmp_path / "a.parquet", tmp_path / "b.parquet"
    for path, evaluations in zip(paths, chain(quadratic(CENTRE, VALLEY))[:2], strict=True):
        evaluations.save(path)
    for files, phase, names in (
        (paths, "cma", NAMES),
        (paths[:1] * 2, "de", NAMES),
        (paths, "cma", NAMES[:3]),
    ):
        evaluations = Evaluations.load("toy", names, *files)
        content, best = theta_content(evaluations, "band1", {}), evaluations.best_row()
        assert best["total"] == content["loss"]["total"] == evaluations.total.min()
        assert content["theta"] == {name: best[name] for name in names}
        np.testing.assert_array_equal(
            list(content["theta"].values()), 10 * evaluations.unit[np.argmin(evaluations.total)]
        )
        assert content["rollouts"] == len(evaluations.total)
        assert (content["band"], content["method"]) == ("band1", "toy")
        assert content["found"]["phase"] == phase
        assert content["confidence"] is None
