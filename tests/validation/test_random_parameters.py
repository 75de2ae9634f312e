"""The campaign of random parameter sets: what it draws, and that it counts what is not marked."""

from dataclasses import replace

import numpy as np
import pytest

from pipeline.params import load
from pipeline.params.identification import parameter_names
from pipeline.simulator.rubber import NEO_HOOKEAN, RUBBER
from tests.project import DEFAULTS
from validation.campaigns import random_parameters
from validation.simulator import robustness
from validation.simulator.finding import Bench


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench(load(DEFAULTS))


def test_the_sets_fill_the_box_of_each_law(bench) -> None:
    sets = random_parameters.random_sets(bench, RUBBER, 500)
    points = np.stack([sets.column(name) for name in parameter_names(RUBBER)], axis=1)
    boxes = [(box.low, box.high) for _, box in bench.params.parameters]
    boxes += [(-0.3, 0.9), (0.0, 0.3), (0.0, 0.6), (0.0, 0.1)]
    low, high = np.array(boxes).T
    assert points.shape == (500, 9)
    assert ((low <= points) & (points <= high)).all()
    assert (np.ptp(points[:, 5:], axis=0) > 0.9 * (high - low)[5:]).all()
    assert len(random_parameters.random_sets(bench, NEO_HOOKEAN, 3)) == 3


def test_what_is_not_finite_and_not_marked_is_counted(bench, monkeypatch) -> None:
    sound = random_parameters.surveyed(bench, NEO_HOOKEAN, 8)
    assert [survey["not_finite"] for survey in sound.values()] == [0, 0, 0]
    true = robustness.interact

    def broken(*args, **options):
        done = true(*args, **options)
        return replace(done, force=np.nan * done.force, failure=[None] * len(done.failure))

    monkeypatch.setattr(robustness, "interact", broken)
    surveys = random_parameters.surveyed(bench, NEO_HOOKEAN, 8)
    assert [surveys[name]["not_finite"] for name in ("held_fast", "default_grip")] == [4, 4]
