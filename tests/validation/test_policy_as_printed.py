"""The campaign of the paper's way to train: what is kept, and what is made of it."""

import numpy as np
import pytest

from pipeline.base.files import write_json
from pipeline.params import load
from pipeline.simulator.parameters import THETA
from tests.policy import toy
from tests.project import DEFAULTS, with_
from validation.campaigns import policy_as_printed as campaign
from validation.campaigns.policy_as_printed import SWITCHES, Lesson, result, summary

POINT = (2e5, 0.47, 2e-3, 0.5, 0.6)


@pytest.fixture
def params(tmp_path, monkeypatch):
    """For trainings of two iterations on the toy, whose launches are counted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(campaign, "simulator", lambda *args: toy.launch)
    content = {"band": "band1", "theta": dict(zip(THETA, POINT, strict=True))}
    write_json(tmp_path / "data/theta/band1/de.json", content)
    small = {"envs": 16, "iterations": 2, "map_size": (9, 7), "hidden": (16,)}
    return with_(load(DEFAULTS), "policy", **small)


def test_each_switch_trains_another_policy_and_is_kept(params, tmp_path, monkeypatch) -> None:
    lessons = [Lesson("band1", switch, 1) for switch in SWITCHES]
    results = [result(lesson, params, tmp_path, "de") for lesson in lessons]
    assert len({tuple(row["error_m"]) for row in results}) == len(SWITCHES) == 5
    assert {row["switch"]: row["std"] == results[0]["std"] for row in results} == {
        "usual": True, "landings": True, "state": True, "exploration": False, "all": False
    }  # fmt: skip
    monkeypatch.setattr(campaign, "train", None)  # a second training would fail
    again = [result(lesson, params, tmp_path, "de") for lesson in lessons]
    assert again == results
    wider = with_(params, "setup", max_force=20.0)
    with pytest.raises(TypeError):
        result(lessons[0], wider, tmp_path, "de")


def test_a_target_out_of_reach_is_no_landing(params, tmp_path) -> None:
    weak = with_(params, "setup", max_force=1e-3)
    row = result(Lesson("band1", "usual", 1), weak, tmp_path, "de")
    assert row["error_m"] == [None] * 3 and row["range_mean_error_m"] is None
    figures = summary([row])["band1"]["usual"]
    assert figures["miss_cm"]["mean"] is None and figures["range_failures"] == 256


def test_means_are_those_of_the_seeds() -> None:
    usual = {"range_mean_error_m": 0.01, "last_error_m": 0.02, "range_failures": {}, "wall_s": 1.0}
    results = [
        {"band": "b", "switch": "usual", "error_m": [miss, 0.0, 0.0], "std": 0.1, **usual}
        for miss in (0.03, 0.06)
    ]
    figures = summary(results)["b"]["usual"]
    assert figures["miss_cm"]["mean"] == pytest.approx(1.5) and figures["miss_cm"]["n"] == 2
    np.testing.assert_allclose(figures["miss_cm_each"], [[3, 0, 0], [6, 0, 0]])
    assert figures["range_miss_cm"]["mean"] == pytest.approx(1.0)
    assert figures["last_miss_cm"]["mean"] == pytest.approx(2.0)
