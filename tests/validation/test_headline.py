"""README's table: what it makes of campaigns by hand, and that it has every committed one."""

import numpy as np
import pytest

from sling2sim2real.simulator.rubber import COROTATED
from validation import headline
from validation.campaigns.rig_scores import TARGETS
from validation.campaigns.runner import OURS, PAPER


def campaign(rollouts: int, **misses: list[float]) -> dict:
    """Ablations on which each method misses alike on every band, by recording [cm]."""
    of_band = {"methods": {name: {"miss_cm_each": each} for name, each in misses.items()}}
    return {
        "figures": dict.fromkeys(headline.BANDS, of_band),
        "settings": {"rollouts": dict.fromkeys(misses, rollouts)},
    }


@pytest.fixture
def campaigns() -> tuple[dict, dict]:
    misses = {OURS: [6.0, 30.0], "package_si": [10.0, 20.0], "real2sim2real": [1.0, 2.0]}
    return campaign(600, **misses), campaign(5760, **{COROTATED: [8.0]})


def test_a_row_has_the_mean_the_least_and_the_most_of_recordings(campaigns) -> None:
    rows = headline.table(*campaigns, dict.fromkeys(headline.BANDS, np.array([1.0, 4.0])))
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]
    names = ["the paper's method", "Package SI", "Real2Sim2Real", *["**`posterior`"] * 2]
    assert [row[0].partition(",")[0] for row in cells] == names
    assert "5,760 rollouts" in cells[0][0] and "600 rollouts" in cells[1][0]
    assert cells[1][1:] == ["15.0 (10.0 to 20.0)"] * 3 + ["15.0"]
    assert cells[-1][1:] == ["2.5 (1.0 to 4.0)"] * 3 + ["2.5"]


def test_methods_are_compared_on_the_recordings_that_both_have(campaigns) -> None:
    text = headline.differences(*campaigns)
    assert "on the same 1 recordings" in text and "6.0 cm in the mean" in text
    assert "misses by −2.0, −2.0 and −2.0 cm more" in text


def test_dips_are_those_of_new_bands_without_a_launch() -> None:
    line = {"method": OURS, "pull": "informative", "worn": False, "launched": False}
    scores = {"error": (0.01 / TARGETS).tolist()}
    lines = [
        line | {"band": band, "scores": scores} | change
        for band in headline.BANDS
        for change in ({}, {"worn": True}, {"launched": True}, {"method": PAPER}, {"failed": "no"})
    ]
    each = headline.dips(lines)
    assert [values.tolist() for values in each.values()] == [pytest.approx([1.0])] * 3
