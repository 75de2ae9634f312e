"""Batches of parameters: slicing, workers, failures, engines, and what is said of them."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.params import load
from sling2sim2real.base.errors import UserError
from sling2sim2real.engines.physx import rollouts
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.identification.objective.evaluate import Evaluator, simulate_of
from sling2sim2real.identification.objective.loss import TERMS
from sling2sim2real.simulator.parameters import THETA
from tests.identification.objective import toy, toy_engine
from tests.project import DEFAULTS
from validation.synthetic import recorded_yardstick

PARAMS = load(DEFAULTS)
EPISODE = toy.episode()
OFFSET, PULL = "poissons_ratio", "youngs_modulus"  # what the toy takes them for
BOX = SearchBox(
    (OFFSET, PULL),
    np.array([0.0, 0.1]),
    np.array([0.01, 10]),
    np.array([0, 1], bool),
    fixed=dict.fromkeys({*THETA} - {OFFSET, PULL}, 0.0),
)


def simulate(sling, episode, parameters, device):
    """A band `offset` away and a force `pull`; beyond 8 mm it fails, beyond 9 N it is NaN."""
    assert (sling, episode, device) == (toy.SLING, EPISODE, "cpu")
    offset, pull = parameters.column(OFFSET), parameters.column(PULL)
    result = toy.rollouts(episode, count=len(parameters))
    result.center_line[..., 2] -= offset[:, None, None].astype(np.float32)
    result.force[..., 0] = np.where(pull > 9, np.nan, pull)[:, None]
    result.failure = ["too far" if far else None for far in offset > 0.008]
    return result


def evaluator(workers: int = 1, **options) -> Evaluator:
    loss = toy.loss_of(EPISODE, weights={"geom": 1.0, "force": 0.5, "work": 1.0})
    options = {"workers": workers, "simulate": simulate, **options}
    return Evaluator(EPISODE, toy.SLING, loss, BOX, **options)


def test_losses_of_a_batch() -> None:
    """Physical values in, weighted sum out; the unit cube is what was asked."""
    unit = np.array([[0.5, 0.5], [0.0, 0.0]])
    evaluation = evaluator(1)(unit)
    np.testing.assert_array_equal(evaluation.unit, unit)
    np.testing.assert_allclose(evaluation.theta, [[0.005, 1.0], [0.0, 0.1]])
    np.testing.assert_allclose(evaluation.terms["geom"], [0.5, 0.0], atol=0.01)
    np.testing.assert_allclose(evaluation.terms["force"], [1.0, 0.1])
    np.testing.assert_allclose(
        evaluation.total, evaluation.terms["geom"] + 0.5 * evaluation.terms["force"]
    )
    assert evaluation.failure == [None, None]


def test_the_number_of_workers_changes_nothing() -> None:
    """Rows in their order, failures too."""
    unit = np.random.default_rng(1).random((67, 2))
    serial, several = evaluator()(unit), evaluator(3)(unit)
    np.testing.assert_array_equal(serial.theta, several.theta)
    np.testing.assert_array_equal(serial.total, several.total)
    assert serial.failure == several.failure
    assert 0 < sum(reason is not None for reason in serial.failure) < 67
    for name in TERMS:
        np.testing.assert_array_equal(serial.terms[name], several.terms[name])


def test_failures_are_infinite_and_have_a_reason() -> None:
    evaluation = evaluator(2)(np.array([[0.9, 0.5], [0.5, 0.999], [0.5, 0.5]]))
    assert evaluation.failure == ["too far", "the loss is not finite", None]
    np.testing.assert_array_equal(np.isinf(evaluation.total), [True, True, False])
    assert np.isnan(evaluation.terms["geom"][:2]).all()


def test_an_engine_of_ours_is_found_by_its_name() -> None:

    assert simulate_of("physx") is rollouts.simulate


@pytest.mark.parametrize(
    "name, words",
    [
        ("nowhere.at_all:simulate", "No module named 'nowhere'"),
        ("tests.identification.objective.toy_engine:none", "no attribute 'none'"),
        ("tests.identification.objective.toy_engine:SOFTER", "must be a function"),
    ],
)
def test_what_is_no_function_is_one_line(name, words) -> None:
    with pytest.raises(UserError, match=words):
        simulate_of(name)


def test_another_engine_changes_the_loss_and_gets_whole_batches(monkeypatch) -> None:
    sling, recorded = recorded_yardstick(PARAMS)
    sling = replace(sling, law=PARAMS.methods["paper"].law)
    theirs = "tests.identification.objective.toy_engine:simulate"
    methods = PARAMS.methods
    other = methods["paper"].model_copy(update={"engine": theirs})
    params = PARAMS.model_copy(update={"methods": dict(methods.items()) | {"other": other}})
    unit = np.random.default_rng(1).random((20, 5))  # more than a slice of the CPU
    toy_engine.batches.clear()
    ours, others = (
        Evaluator.of(params, name, recorded, sling)(unit) for name in ("paper", "other")
    )
    assert toy_engine.batches == [20]
    both = np.isfinite(ours.total) & np.isfinite(others.total)
    assert both.sum() > 5 and (ours.total[both] != others.total[both]).all()
