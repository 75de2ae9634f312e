"""The campaign of landings by each pull: what it runs, and what it says of results by hand."""

import json

import numpy as np
import pytest

from tests.project import ROOT
from validation.campaigns.landings import PAGE, SETS, OneRecording, block, figures, jobs, report_of
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import OURS
from validation.rubbers import DEVELOP, SEALED, UNSEEN_LAWS, rubbers


def test_each_band_is_recorded_by_both_pulls_and_once_after_it_was_drawn() -> None:
    for name, (seed, bands, count, states) in SETS.items():
        every = jobs(name)
        assert len(set(every)) == len(every) and {one.seed for one in every} == {seed}
        other = [one for one in every if one.launched or one.method != OURS]
        assert {one.kind for one in other} == {
            "paper, virgin, the paper's method",
            "informative, virgin, the paper's method",
            "informative, virgin, one launch",
        }
        assert len(other) == 3 * len(bands) and {one.number for one in other} == {0}
        every = [one for one in every if one not in other]
        virgin = [one for one in every if not one.worn]
        assert len(virgin) == 2 * count * len(bands)
        assert len(every) - len(virgin) == 2 * len(bands) * (True in states)
    job = OneRecording(DEVELOP, "develop1", "informative", True, 0)
    assert job.params.rig.pull == "informative" and job.params.bands["develop1"].preconditioned


def test_half_of_the_sealed_rubbers_soften_by_laws_that_none_was_developed_on() -> None:
    sealed, known = rubbers(SEALED), rubbers(DEVELOP)
    assert len(sealed) >= 16
    assert {about["law"] for _, about in sealed.values()} == {*UNSEEN_LAWS}
    assert not {about["law"] for _, about in known.values()} & {*UNSEEN_LAWS}
    assert 2 * sum(about["softening"] is not None for _, about in sealed.values()) == len(sealed)


JOB = vars(OneRecording(DEVELOP, "a", "paper", False, 0))


def scores(error: float, inside: int) -> dict:
    landing = TARGETS * (1 + error)
    return {
        "error": [error] * 9,
        "miss": (landing - TARGETS).tolist(),
        "low": (TARGETS - 0.1).tolist(),
        "high": (TARGETS + 0.1).tolist(),
        "inside": [True] * inside + [False] * (9 - inside),
    }


def test_figures_are_means_over_bands() -> None:
    lines = [
        JOB | {"band": band, "scores": one} | {"told": {"settled": settled}}
        for band, one, settled in (
            ("a", scores(0.04, 9), True),
            ("b", scores(-0.02, 0), False),
        )
    ]
    lines.append(JOB | {"band": "a", "number": 1, "failed": "no band"})
    (summary,) = figures(lines).values()
    assert summary["settled"] == [1, 2] and summary["refused"] == {"a 1": "no band"}
    about = summary["together"]
    assert about["mean_size_of_bias"] == pytest.approx(0.03)
    assert about["worst_bias"] == pytest.approx(0.04)
    assert (about["coverage"], about["least_coverage"]) == (0.5, 0.0)
    assert about["coverage_by_bands"] == [0.0, 1.0]
    assert about["median_width"] == pytest.approx(np.median(0.2 / TARGETS))


def test_the_page_has_the_table_of_the_committed_reports(monkeypatch) -> None:
    monkeypatch.chdir(ROOT)
    contents = {name: json.loads(report_of(name).read_text("utf-8")) for name in SETS}
    assert block(contents) in (ROOT / PAGE).read_text("utf-8")
