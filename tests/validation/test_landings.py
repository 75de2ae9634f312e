"""The campaign of landings by each pull: what it runs, and what it says of results by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.params import load
from rig.oracle.world import ExactLaunches
from rig.physics.launch import Trial
from validation.campaigns import rig_scores
from validation.campaigns.landings import (
    FIRST,
    OneRecording,
    figures,
)
from validation.campaigns.rig_scores import TARGETS
from validation.projects import DEFAULTS
from validation.rubbers import DEVELOP, SEALED, UNSEEN_LAWS, rubbers


def test_half_of_the_sealed_rubbers_soften_by_laws_that_none_was_developed_on() -> None:
    sealed, developed = rubbers(SEALED), rubbers(DEVELOP)
    assert len(sealed) >= 16
    assert {rubber["law"] for _, rubber in sealed.values()} == {*UNSEEN_LAWS}
    assert not {rubber["law"] for _, rubber in developed.values()} & {*UNSEEN_LAWS}
    assert 2 * sum(rubber["softening"] is not None for _, rubber in sealed.values()) == len(sealed)


JOB = vars(OneRecording(DEVELOP, "a", "paper", 0)) | {"settled": True}


def scores(error: float, miss: float) -> dict:
    """Nine launches that are off by a share without noise, by `miss` [m] with it."""
    return {
        "error": [error] * 9,
        "miss": [miss] * 9,
        "low": (TARGETS - 0.1).tolist(),
        "high": (TARGETS + 0.1).tolist(),
    }


@pytest.fixture
def summary() -> dict:
    """Of two recordings of one band, off by as much to either side, and one of another."""
    lines = [
        JOB | {"band": "a", "scores": scores(0.04, 0.05)},
        JOB | {"band": "a", "number": 1, "scores": scores(-0.04, 0.4), "settled": False},
        JOB | {"band": "b", "scores": scores(-0.01, -0.05)},
        JOB | {"band": "a", "number": 2, "failed": "no band"},
    ]
    return figures(lines)


def test_biases_of_a_bands_recordings_do_not_cancel(summary) -> None:
    together = summary["paper, virgin"]["together"]
    assert summary["paper, virgin"]["bands"]["a"]["mean_bias"] == pytest.approx(0)
    assert together["mean_size_of_bias"] == pytest.approx((0.04 + 0.01) / 2)
    assert abs(together["worst_bias"]) == pytest.approx(0.04)  # of a recording


def test_a_launch_beyond_the_area_counts(summary) -> None:
    """0.4 m too far is beyond it from seven of the targets."""
    together = summary["paper, virgin"]["together"]
    assert (together["launches"], together["failed"]) == (27, 0)
    assert together["mean_miss_m"] == pytest.approx(((0.05 + 0.4) / 2 + 0.05) / 2)
    assert together["coverage"] == pytest.approx((0.5 + 1) / 2)
    assert together["least_coverage"] == pytest.approx(0.5)
    assert together["least_coverage_of_a_recording"] == 0
    assert together["median_width"] == pytest.approx(np.median(0.2 / TARGETS))


def test_a_launch_that_does_not_land_is_no_launch(summary) -> None:
    lost = scores(0.04, 0.05)
    lost["miss"][0] = lost["error"][3] = None
    (of,) = (figures([JOB | {"scores": lost}])[kind]["together"] for kind in ("paper, virgin",))
    assert (of["launches"], of["failed"], of["coverage"]) == (8, 2, 1.0)


def test_what_is_compared_with_another_method_is_of_the_same_recordings(summary) -> None:
    first = summary[f"paper, virgin, {FIRST}"]
    assert first["together"]["mean_size_of_bias"] == pytest.approx((0.04 + 0.01) / 2)
    assert first["bands"]["a"]["bias"] == pytest.approx([0.04])
    assert first["settled"] == [2, 2] and summary["paper, virgin"]["settled"] == [2, 3]
    assert summary["paper, virgin"]["refused"] == {"a 2": "no band"}


class Everywhere:
    """A world in which a launch lands beyond the area, and says so."""

    def exact(self, draws: np.ndarray) -> ExactLaunches:
        return ExactLaunches(np.full(len(draws), 2.6), np.ones(len(draws)), [None] * len(draws))

    def trials(self, draws: np.ndarray, numbers: list[int]) -> list[Trial]:
        return [Trial(2.6, "beyond the area", 1.0) for _ in draws]


def test_scores_count_where_a_launch_lands_not_whether_on_the_board(monkeypatch) -> None:
    monkeypatch.setattr(rig_scores, "aimed", lambda *_: np.tile([-0.35, -0.1], (9, 1)))
    outcome, params = SimpleNamespace(samples=None), load(DEFAULTS)
    assert rig_scores.scored(outcome, params, Everywhere())["miss"] == pytest.approx(2.6 - TARGETS)
