"""Optimisers by their names: the built-in ones, a user's own, and what is refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.params import Params
from sling2sim2real.base.errors import UserError
from sling2sim2real.identification.optimizers.de.evolution import Evolution
from sling2sim2real.identification.search.build import build, explorer
from sling2sim2real.identification.search.loop import latin_hypercube
from tests.identification.search.functions import Evaluate, alone, rosenbrock
from tests.project import DEFAULTS

TEXT = DEFAULTS.read_text(encoding="utf-8")
OWN = "tests.identification.search.own:RandomSearch"


def method(**more):
    """params.yaml's optimiser, and its method sling2sim2real with other keys."""
    params = Params.parse(TEXT)
    method_params = params.methods["sling2sim2real"].model_copy(update=more)
    return method_params, params.optimizer


def test_a_multistart_explores_as_differential_evolution_does() -> None:
    for search in ("multistart", "de"):
        evolution = explorer(*method(search=search), 4, 60)
        assert isinstance(evolution, Evolution)
        np.testing.assert_array_equal(evolution.ask(), latin_hypercube(4, 20, 1))


def test_the_explorer_moves_as_params_say() -> None:
    method_params, optimizer = method()
    still = optimizer.model_copy(update={"recombination": 0.0, "mutation": (0.0, 0.1)})
    second = []
    for settings in (optimizer, still):
        evolution = explorer(method_params, settings, 4, 60)
        evolution.tell(rosenbrock(evolution.ask()))
        second.append(evolution.ask())
    assert not np.array_equal(*second)


def test_a_class_of_ones_own_gets_its_settings() -> None:
    evaluations = alone(OWN, Evaluate(rosenbrock), 20)
    assert set(evaluations.table["phase"].to_pylist()) == {"random"}
    assert explorer(*method(search=OWN, settings={"batch": 3}), 4, 60).ask().shape == (3, 4)


def test_a_class_beside_params_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By commands as well, which do not look where they are called."""
    source = "from tests.identification.search.own import RandomSearch as Mine\n"
    (tmp_path / "beside_params.py").write_text(source)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.chdir(tmp_path)
    optimizer = build("beside_params:Mine", 4, rollouts=60, seed=1, population=20)
    assert optimizer.ask().shape == (7, 4)


REFUSED = (
    ("nowhere.at_all:Class", {}, "(ModuleNotFoundError: No module named 'nowhere')"),
    (
        "tests.identification.search.own:Absent",
        {},
        "cannot be imported (AttributeError: module 'tests.",
    ),
    (
        "tests.identification.search.broken:Class",
        {},
        "cannot be imported (ZeroDivisionError: division",
    ),
    ("tests.identification.search.own:Deaf", {}, "is no optimiser, it lacks ask, tell"),
    ("tests.identification.search.own:Nameless", {}, "is no optimiser, it lacks phase, a text"),
    (
        "tests.identification.search.own:Choosy",
        {"name": "y"},
        "take its settings: no such name, sorry: y",
    ),
    ("tests.identification.search.own:Lost", {}, "does not take its settings: KeyError('name')"),
    ("math:hypot", {}, "cannot be called as Class(dimension, rollouts, seed, population)"),
    (OWN, {"rate": 1.0}, "got an unexpected keyword argument 'rate'"),
    ("de", {"dimension": 3}, "multiple values for argument 'dimension'"),
    ("de", {"mutation": 7.0}, "mutation must be from 0 to below 2"),
    ("de", {"mutation": "much"}, "could not convert string to float"),
    ("bo", {"points": 1}, "points must be a whole number above 1, got 1"),
    ("adam", {"step": 0.0}, "rate and step must be above 0"),
)


def test_what_is_no_optimiser_is_refused_in_one_line() -> None:
    for name, settings, expected in REFUSED:
        with pytest.raises(UserError) as error:
            build(name, 4, rollouts=60, seed=1, population=20, **settings)
        assert expected in str(error.value)
        assert "`search` under `methods` in params.yaml" in str(error.value)
        assert "\n" not in str(error.value)


def test_what_is_asked_for_is_checked() -> None:
    """Points of the unit cube, and a number for each of who asked, if any."""
    for name, match in (
        ("Outside", r"Outside: ask\(\) must give points of the unit cube"),
        ("Flat", r"shape \(N, 4\), and gave shape \(1, 5\)"),
        ("Words", r"shape \(N, 4\), and gave no array of numbers"),
        ("Crowd", "Crowd: owner must be 7 whole numbers"),
        ("Strangers", "Strangers: owner must be 7 whole numbers"),
    ):
        with pytest.raises(UserError, match=match):
            alone(
                f"tests.identification.search.own:{name}",
                Evaluate(rosenbrock),
                50,
                names=tuple("abcd"),
            )
