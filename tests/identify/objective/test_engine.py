"""A method's engine: ours, one of another package's, or a function of the user's."""

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.identify.objective import session
from pipeline.identify.objective.engine import simulate_of, sources_of
from pipeline.identify.objective.evaluate import simulated
from tests.identify.objective import toy_engine
from tests.identify.objective.test_evaluate import PARAMS, recorded_yardstick


def test_ours_needs_no_import() -> None:
    assert simulate_of("sling") is simulated
    assert sources_of("sling") == []


@pytest.mark.parametrize(
    "engine, words",
    [
        ("nowhere.at_all:simulate", "No module named 'nowhere'"),
        ("tests.identify.objective.toy_engine:none", "no attribute 'none'"),
        ("tests.identify.objective.toy_engine:SOFTER", "must be a function"),
    ],
)
def test_what_is_no_function_is_one_line(engine, words) -> None:
    with pytest.raises(UserError, match=words):
        simulate_of(engine)


def test_another_engine_changes_the_loss_and_gets_whole_batches(monkeypatch) -> None:
    sling, recorded = recorded_yardstick(PARAMS)
    theirs = "tests.identify.objective.toy_engine:simulate"
    methods = PARAMS.methods
    other = methods["sling2sim2real"].model_copy(update={"engine": theirs})
    params = PARAMS.model_copy(update={"methods": dict(methods.items()) | {"other": other}})
    monkeypatch.setattr(session, "load_episode", lambda band: recorded)
    monkeypatch.setattr(session, "sling_of_method", lambda *_: sling)
    unit = np.random.default_rng(1).random((20, 5))  # more than a slice of the CPU
    toy_engine.batches.clear()
    ours, others = (
        session.evaluator(params, "band1", name)(unit) for name in ("sling2sim2real", "other")
    )
    assert toy_engine.batches == [20]
    both = np.isfinite(ours.total) & np.isfinite(others.total)
    assert both.sum() > 5 and (ours.total[both] != others.total[both]).all()


def test_its_folder_is_among_the_sources() -> None:
    assert [one.name for one in sources_of("tests.identify.objective.toy_engine:simulate")] == [
        "objective"
    ]
