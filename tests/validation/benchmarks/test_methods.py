"""`sling bench --methods` times what the stages do, and its yardstick is met by its own theta."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.identify.objective.box import SearchBox
from pipeline.identify.objective.evaluate import Evaluator
from pipeline.identify.objective.loss import EpisodeLoss
from pipeline.identify.search.explore import rollouts_of
from pipeline.params import load
from tests.project import DEFAULTS, with_
from validation.benchmarks import methods as bench
from validation.synthetic import THETA, recorded_yardstick

PARAMS = load(DEFAULTS)
SMALL = {"population": 6, "generations": 2, "cma_population": 4, "cma_rollouts": 16, "k_top": 2}
EXPLORED = 18  # of them


def test_the_recorded_theta_is_where_the_loss_is_least() -> None:
    """No sensor has noise: the force agrees to rounding, and every other theta is worse."""
    sling, episode = recorded_yardstick(PARAMS)
    space = SearchBox.of(PARAMS.parameters)
    loss = EpisodeLoss.of(PARAMS, "sling2sim2real", episode, sling)
    evaluate = Evaluator(episode, sling, loss, space, workers=1)
    truth = space.to_unit(np.array([THETA]))
    others = np.random.default_rng(1).random((15, 5))
    evaluation = evaluate(np.concatenate([truth, others]))
    assert evaluation.terms["force"][0] < 1e-3
    assert evaluation.terms["work"][0] < 1e-3
    assert evaluation.total[0] < evaluation.total[1:].min() / 2


def test_every_search_spends_its_budget_and_says_what_it_took(monkeypatch) -> None:
    monkeypatch.setitem(bench.BUDGETS, "laptop", SMALL)
    names = ("sling2sim2real", "package_si", "least_squares")
    params = PARAMS.model_copy(update={"methods": {name: PARAMS.methods[name] for name in names}})
    result = bench.bench_methods(params)
    assert list(result["methods"]) == list(names)
    for name, row in result["methods"].items():
        fitted = name == "least_squares"  # its steps settle by themselves
        assert row["rollouts"] > EXPLORED if fitted else row["rollouts"] == EXPLORED + 16
        assert row["regions"] == (2 if name == "sling2sim2real" else 0)
        assert row["seconds"] == pytest.approx(row["evaluation_s"] + row["optimizer_s"])
        assert min(row["evaluation_s"], row["optimizer_s"]) > 0
        assert np.isfinite(row["best_loss"]) and 0 <= row["others_share"] <= 1
    assert min(result["batch"]["simulation_s"], result["batch"]["with_loss_s"]) > 0
    text = bench.table(result)
    assert all(name in text for name in names)


def test_a_search_is_timed_in_the_box_of_its_method() -> None:
    """Bounds of the method included."""
    sling, episode = recorded_yardstick(PARAMS)
    for method in ("sling2sim2real", "least_squares"):
        evaluate = bench.evaluator(PARAMS, method, sling, episode, ["cpu"])
        expected = SearchBox.of_method(PARAMS, method)
        assert evaluate.box.names == expected.names
        np.testing.assert_array_equal(evaluate.box.low, expected.low)
        np.testing.assert_array_equal(evaluate.box.high, expected.high)


def test_the_large_budget_is_ten_times_the_laptops() -> None:
    params = with_(PARAMS, "optimizer", **bench.BUDGETS["large"])
    assert rollouts_of(params, "sling2sim2real") == 2560 and params.optimizer.cma_rollouts == 3200
    assert rollouts_of(params, "bo") == 5760


def test_a_device_that_is_not_there_is_refused() -> None:
    with pytest.raises(UserError, match="--device must be cpu.*got 'tpu:0'"):
        bench.bench_methods(PARAMS, device="tpu:0")
