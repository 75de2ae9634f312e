"""Searches by name and to their budget, and the whole chain, on functions with known minima."""

import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from pipeline.params import Params, load
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.objective.box import SearchBox, latin_hypercube
from sling2sim2real.identification.results.evaluations import Evaluations, theta_content
from sling2sim2real.identification.search import explore, rollouts_of, run
from tests.identification.searches import functions
from tests.identification.searches.functions import (
    CENTRE,
    NAMES,
    Evaluate,
    alone,
    chain,
    changed,
    cube,
    quadratic,
    rosenbrock,
)
from tests.project import DEFAULTS

OWN = "tests.identification.searches.own"
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
        "tests.identification.searches.own:random_search",
    ):  # which looks at what it gets
        evaluations = alone(name, evaluate, 312)
        assert np.isinf(evaluations.total).all()
        with pytest.raises(UserError, match="each of 312 simulations failed"):
            evaluations.best_row()


class Recorder:
    """Asks for batches of sizes that were given, and keeps the losses that it gets."""

    def __init__(self, *sizes: int) -> None:
        self._sizes, self.got = sizes, []

    def __call__(self, evaluate) -> None:
        for size in self._sizes:
            self.got.append(evaluate(np.full((size, 5), 0.5)))


def recorded(recorder, evaluate, rollouts: int) -> Evaluations:
    evaluations = Evaluations("toy", NAMES)
    run(recorder, evaluate, evaluations, phase="toy", rollouts=rollouts, box=cube(NAMES))
    return evaluations


@given(sizes=st.lists(st.integers(1, 9), min_size=1, max_size=9), data=st.data())
def test_exactly_the_budget_is_spent(sizes: list[int], data: st.DataObject) -> None:
    """Whatever sizes are asked for; a search does not see the losses of its last batch."""
    rollouts = data.draw(st.integers(1, sum(sizes)))
    recorder = Recorder(*sizes)
    evaluations = recorded(recorder, quadratic(CENTRE, np.eye(5)), rollouts)
    assert len(evaluations.total) == rollouts
    whole = [size for size, end in zip(sizes, np.cumsum(sizes), strict=True) if end < rollouts]
    assert [len(losses) for losses in recorder.got] == whole
    generation = np.repeat(np.arange(len(sizes)), sizes)[:rollouts]
    assert evaluations.table["generation"].to_pylist() == generation.tolist()


def test_failed_points_are_told_as_twice_the_worst_so_far() -> None:
    values = iter([np.array([1.0, np.inf, 3.0]), np.array([2.0, np.inf]), np.array([4.0, np.inf])])
    evaluate = Evaluate(lambda unit: next(values), fails=lambda unit: np.arange(len(unit)) == 1)
    recorder = Recorder(3, 2, 2)
    recorded(recorder, evaluate, 8)
    assert [losses.tolist() for losses in recorder.got] == [[1.0, 6.0, 3.0], [2.0, 6.0], [4.0, 8.0]]


def test_fixed_axes_keep_their_physical_values() -> None:
    """The optimiser searches the other axes; the evaluations have all of them."""
    parameters = load(DEFAULTS).parameters
    fixed = {"poissons_ratio": 0.45, "elasticity_damping": 5e-3}
    box = SearchBox.of(parameters, fixed=fixed)
    assert box.free == ("youngs_modulus", "dynamic_friction", "damping_scale")
    evaluate = quadratic(CENTRE, np.eye(5))
    evaluate.box = box
    evaluations = alone("de", evaluate, 600, changed(population=20), box=box)
    np.testing.assert_allclose(evaluations.table["poissons_ratio"], 0.45, rtol=1e-12)
    np.testing.assert_allclose(evaluations.table["elasticity_damping"], 5e-3, rtol=1e-12)
    best = [evaluations.best_row()[f"unit_{name}"] for name in box.free]
    np.testing.assert_allclose(best, CENTRE[[0, 3, 4]], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["de", "bo", "adam", f"{OWN}:random_search"])
def test_an_optimiser_is_deterministic_and_leaves_global_generators_alone(name) -> None:
    """It starts, if it is ours, from the common Latin hypercube."""
    runs = []
    for number, seed in enumerate((1, 1, 2)):
        np.random.seed(number), torch.manual_seed(number)
        states = np.random.get_state()[1].copy(), torch.random.get_rng_state()
        optimizer = changed(seed=seed, population=8)
        runs.append(alone(name, quadratic(CENTRE, VALLEY), 29, optimizer))
        np.testing.assert_array_equal(np.random.get_state()[1], states[0])
        assert torch.equal(torch.random.get_rng_state(), states[1])
        assert len(runs[-1].total) == 29
        assert runs[-1].unit.min() >= 0 and runs[-1].unit.max() <= 1
    assert runs[0].table.equals(runs[1].table)
    assert not runs[0].table.equals(runs[2].table)
    if ":" not in name:
        assert set(runs[0].table["phase"].to_pylist()) == {name}
        np.testing.assert_array_equal(runs[0].unit[:8], latin_hypercube(5, 8, 1))


def test_every_search_has_the_same_budget() -> None:
    params = load(DEFAULTS)
    optimizer, explore = params.optimizer, rollouts_of(params, "paper")
    assert explore == optimizer.population * (optimizer.generations + 1)
    assert rollouts_of(params, "bo") == explore + optimizer.cma_rollouts == 600


def test_theta_is_the_best_of_both_phases(tmp_path) -> None:
    paths = tmp_path / "a.parquet", tmp_path / "b.parquet"
    for path, evaluations in zip(paths, chain(quadratic(CENTRE, VALLEY))[:2], strict=True):
        evaluations.save(path)
    for files, phase in ((paths, "cma"), (paths[:1] * 2, "de")):
        evaluations = Evaluations.load("toy", *files)
        content, best = theta_content(evaluations, "band1", {}), evaluations.best_row()
        assert best["total"] == content["loss"]["total"] == evaluations.total.min()
        place = 10 * evaluations.unit[np.argmin(evaluations.total)]
        assert content["theta"] == dict(zip(NAMES, place, strict=True))
        assert content["rollouts"] == len(evaluations.total)
        assert content["found"]["phase"] == phase


REFUSED = (
    ("nowhere.at_all:f", {}, "(ModuleNotFoundError: No module named 'nowhere')"),
    (f"{OWN}:choosy", {"name": "y"}, "take its settings: no such name, sorry: y"),
    (
        f"{OWN}:outside",
        {},
        "evaluate() takes points of the unit cube, shape (N, 5), and got coordi",
    ),
    (f"{OWN}:flat", {"batch": 1}, "shape (N, 4), and got shape (1, 5)"),
    (f"{OWN}:words", {}, "and got no array of numbers"),
    (f"{OWN}:random_search", {"rate": 1.0}, "got an unexpected keyword argument 'rate'"),
    ("de", {"mutation": 7.0}, "does not take its settings: "),
    ("bo", {"points": 1}, "points must be a whole number above 1, got 1"),
)


def with_search(name: str, **more):
    params = Params.parse(DEFAULTS.read_text(encoding="utf-8"))
    method = params.methods["real2sim2real"].model_copy(update={"search": name, **more})
    return params.model_copy(update={"methods": {"mine": method}})


@pytest.mark.parametrize(("name", "settings", "expected"), REFUSED)
def test_what_is_no_search_is_refused_in_one_line(name, settings, expected) -> None:
    fixed = {"poissons_ratio": 0.45} if "4)" in expected else {}
    params = with_search(name, settings=settings, fixed=fixed)
    with pytest.raises(UserError) as error:
        explore(params, "mine", Evaluate(rosenbrock))
    message = str(error.value)
    assert expected in message and message.startswith("search ") and "\n" not in message
    assert "evaluate()" in message or "`search` under `methods` in params.yaml" in message


def test_a_function_of_ones_own_gets_its_settings_and_names_its_rows() -> None:
    params = with_search(f"{OWN}:random_search", settings={"batch": 3}, fixed={})
    table = explore(params, "mine", Evaluate(rosenbrock)).table
    assert set(table["phase"].to_pylist()) == {"random_search"}
    assert table["generation"].to_pylist()[:4] == [0, 0, 0, 1] and len(table) == 600


def test_a_multistart_explores_as_differential_evolution_does_and_moves_as_params_say() -> None:
    params = with_search("de", fixed={})
    budget = params.optimizer.model_copy(update={"cma_rollouts": 0})
    seen = [
        explore(params.model_copy(update={"optimizer": optimizer}), "mine", Evaluate(rosenbrock))
        for params, optimizer in (
            (params, budget),
            (with_search("multistart", fixed={}), params.optimizer),
            (params, budget.model_copy(update={"recombination": 0.0, "mutation": (0.0, 0.1)})),
        )
    ]
    np.testing.assert_array_equal(seen[0].unit, seen[1].unit)
    assert not np.array_equal(seen[0].unit, seen[2].unit)


def test_a_function_beside_params_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By commands as well, which do not look where they are called."""
    source = f"from {OWN} import random_search as mine\n"
    (tmp_path / "beside_params.py").write_text(source)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(tmp_path)
    assert len(alone("beside_params:mine", Evaluate(rosenbrock), 14).total) == 14
