"""The campaign of one change at a time: what a variant is, and what the page has of it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pipeline.base.errors import UserError
from pipeline.episode.episode import Episode
from pipeline.identify.posterior.likelihood import Tolerances
from pipeline.identify.posterior.residuals import Rule
from pipeline.params import load
from tests.project import ROOT
from validation.campaigns.attribution import (
    METHODS,
    PAGE,
    REPORT,
    against_given,
    block,
    expect_orange,
    recoil_of,
)
from validation.campaigns.runner import OURS, ResultLines
from validation.campaigns.variants import with_variants
from validation.projects import DEFAULTS


@pytest.fixture
def episode() -> Episode:
    """Of a held band and three pictures of its recoil, the latest stamped first."""
    signals, points = np.zeros((2, 3)), np.full((5, 3), -1.0, np.float32)
    return Episode(
        band="orange",
        time=np.array([0.0, 1.0]),
        position=signals,
        velocity=signals,
        force=signals,
        opening=np.zeros(2),
        cloud_time=np.array([0.9, 1.09, 1.01, 1.045]),
        clouds=[points] * 4,
        grasp_time=0.0,
        release_time=1.0,
        camera=np.zeros(3),
        metadata={"preprocessing": {"release_error": 1e-4}},
    )


def test_every_variant_is_a_method_or_a_change_of_ours() -> None:
    methods = with_variants(load(DEFAULTS)).methods
    others = METHODS.keys() - methods.keys()
    assert others == {"later_pictures", "recoil_trusted_half"}
    assert methods["no_softening"].fixed == {**methods[OURS].fixed, "softening": 0.0}
    assert methods["no_flow"].fixed["flow"] == 0.0


def test_later_pictures_of_a_recoil_count_within_the_block_alone(episode) -> None:
    usual = Rule().pictures(episode)
    assert usual.tolist() == [0, 2]
    with recoil_of("later_pictures"):
        assert Rule().pictures(episode).tolist() == [0, 2, 3]
    assert Rule().pictures(episode).tolist() == usual.tolist()


def test_a_recoil_is_trusted_half_within_the_block_alone(episode) -> None:
    usual = Tolerances.of(episode)
    with recoil_of("recoil_trusted_half"):
        assert Tolerances.of(episode) == replace(usual, way=2 * Tolerances.way)
    with recoil_of(OURS):
        assert Tolerances.of(episode) == usual
    assert Tolerances.of(episode) == usual


def test_errors_of_given_landings_are_of_what_was_predicted() -> None:
    class Simulator:
        samples = None

        def __call__(self, draws):
            return type("Launches", (), {"landing_y": np.array([2.0, 1.0])})

    scores = against_given(Simulator(), load(DEFAULTS), np.zeros((2, 2)), np.array([2.2, 0.9]))
    assert scores["error"] == pytest.approx([0.1, -0.1])
    assert scores["miss"] == pytest.approx([0.2, -0.1])
    assert np.isnan(scores["low"]).all() and not scores["inside"].any()


def test_results_of_orange_are_not_left_out_of_a_report(tmp_path) -> None:
    lines = ResultLines(tmp_path / "results.jsonl")
    lines.add({"group": "bands"})
    expect_orange(tmp_path, None)
    lines.add({"group": "orange"})
    expect_orange(tmp_path, tmp_path)
    with pytest.raises(UserError, match="give --orange to report them too"):
        expect_orange(tmp_path, None)


def test_the_page_has_the_table_of_the_committed_report() -> None:
    content = json.loads((ROOT / REPORT).read_text(encoding="utf-8"))
    assert content["jobs"][0] == content["jobs"][1]
    assert block(content) in (ROOT / PAGE).read_text(encoding="utf-8")
