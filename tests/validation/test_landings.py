"""The campaign of landings by each pull: what it runs, and what it says of results by hand."""

import numpy as np
import pytest

from validation.campaigns.landings import (
    ONE_DIP,
    SETS,
    OneRecording,
    figures,
    jobs,
)
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import OURS
from validation.rubbers import DEVELOP, SEALED, UNSEEN_LAWS, rubbers


def test_each_band_is_recorded_by_both_pulls_and_once_after_it_was_drawn() -> None:
    for name, (seed, bands, count, states) in SETS.items():
        every = jobs(name)
        assert len(set(every)) == len(every) and {job.seed for job in every} == {seed}
        other = [job for job in every if job.launched or job.method != OURS]
        assert {job.kind for job in other} == {
            "paper, virgin, the paper's method",
            "informative, virgin, the paper's method",
            "informative, virgin, one launch",
        }
        assert len(other) == 3 * len(bands) and {job.number for job in other} == {0}
        every = [job for job in every if job not in other]
        virgin = [job for job in every if not job.worn]
        assert len(virgin) == 2 * count * len(bands)
        assert len(every) - len(virgin) == 2 * len(bands) * (True in states)
    job = OneRecording(DEVELOP, "develop1", "informative", True, 0)
    assert (
        job.params.rig.recordings["plain"].pull == "informative"
        and job.params.bands["develop1"].preconditioned
    )


def test_one_dip_is_recorded_on_the_bands_that_a_choice_may_rest_on() -> None:
    every = jobs(ONE_DIP)
    assert {job.band for job in every} == {*SETS["develop"][1], *SETS["bands"][1]}
    plain = OneRecording(DEVELOP, "band1", "informative", False, 0).params.plan
    (dip,) = every[0].params.plan.dips
    assert dip.depth < min(deep.depth for deep in plain.dips) and len(plain.dips) == 3
    assert every[0].params.rig.recordings["plain"].pull == "informative"


def test_half_of_the_sealed_rubbers_soften_by_laws_that_none_was_developed_on() -> None:
    sealed, developed = rubbers(SEALED), rubbers(DEVELOP)
    assert len(sealed) >= 16
    assert {rubber["law"] for _, rubber in sealed.values()} == {*UNSEEN_LAWS}
    assert not {rubber["law"] for _, rubber in developed.values()} & {*UNSEEN_LAWS}
    assert 2 * sum(rubber["softening"] is not None for _, rubber in sealed.values()) == len(sealed)


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
        JOB | {"band": band, "scores": band_scores} | {"confidence": {"settled": settled}}
        for band, band_scores, settled in (
            ("a", scores(0.04, 9), True),
            ("b", scores(-0.02, 0), False),
        )
    ]
    lines.append(JOB | {"band": "a", "number": 1, "failed": "no band"})
    (summary,) = figures(lines).values()
    assert summary["settled"] == [1, 2] and summary["refused"] == {"a 1": "no band"}
    together = summary["together"]
    assert together["mean_size_of_bias"] == pytest.approx(0.03)
    assert together["worst_bias"] == pytest.approx(0.04)
    assert (together["coverage"], together["least_coverage"]) == (0.5, 0.0)
    assert together["coverage_by_bands"] == [0.0, 1.0]
    assert together["median_width"] == pytest.approx(np.median(0.2 / TARGETS))
