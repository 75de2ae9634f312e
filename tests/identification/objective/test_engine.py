"""A method's engine: ours, one of another package's, or a function of the user's."""

import tomllib
from dataclasses import replace
from importlib.metadata import EntryPoint, EntryPoints

import numpy as np
import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.engines.physx import rollouts
from sling2sim2real.identification.objective import engine, session
from sling2sim2real.identification.objective.engine import simulate_of
from sling2sim2real.identification.objective.evaluate import simulated
from sling2sim2real.settings.identification import ENGINES, OUR_ENGINE
from tests.identification.objective import toy_engine
from tests.identification.objective.test_evaluate import PARAMS, recorded_yardstick
from tests.project import ROOT


def test_ours_needs_no_import() -> None:
    assert simulate_of("sling") is simulated


def test_an_installed_engine_is_found_by_its_name(monkeypatch) -> None:
    """As pyproject.toml offers it; an installation from before that says what to do."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    offered = project["entry-points"][engine.ENTRY_POINT_GROUP]
    points = EntryPoints(EntryPoint(*pair, engine.ENTRY_POINT_GROUP) for pair in offered.items())
    monkeypatch.setattr(engine, "entry_points", points.select)
    assert [*offered] == [name for name in ENGINES if name != OUR_ENGINE]
    assert simulate_of("physx") is rollouts.simulate
    monkeypatch.setattr(engine, "entry_points", EntryPoints().select)
    with pytest.raises(UserError, match="engine physx: .* install this one anew"):
        simulate_of("physx")


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
    monkeypatch.setattr(session, "sling_of_method", lambda *_: sling)
    unit = np.random.default_rng(1).random((20, 5))  # more than a slice of the CPU
    toy_engine.batches.clear()
    ours, others = (
        session.evaluator(params, "band1", name, recorded, None)(unit)
        for name in ("paper", "other")
    )
    assert toy_engine.batches == [20]
    both = np.isfinite(ours.total) & np.isfinite(others.total)
    assert both.sum() > 5 and (ours.total[both] != others.total[both]).all()
