"""README's table: what it makes of campaigns by hand."""

import numpy as np
import pytest

from validation import headline
from validation.campaigns.runner import PAPER, POSTERIOR


@pytest.fixture
def same() -> dict:
    """A campaign in which each method misses alike on every band, by recording [cm]."""
    misses = {
        PAPER: [8.0, 8.0],
        "package_si": [10.0, 20.0],
        "real2sim2real": [1.0, 2.0],
        POSTERIOR: [6.0, 30.0],
    }
    of_band = {"methods": {name: {"miss_cm_each": each} for name, each in misses.items()}}
    rollouts = dict.fromkeys(misses, 5760) | {"package_si": 2400}
    return {
        "figures": dict.fromkeys(headline.BANDS, of_band),
        "settings": {"rollouts": rollouts},
    }


def test_a_row_has_the_mean_the_least_and_the_most_of_recordings(same) -> None:
    rows = headline.table(same, dict.fromkeys(headline.BANDS, np.array([1.0, 4.0])))
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[2:]]
    names = ["the paper's method", "Package SI", "Real2Sim2Real", *["**`posterior`"] * 2]
    assert [row[0].partition(",")[0] for row in cells] == names
    assert "5,760 rollouts" in cells[0][0] and "2,400 rollouts" in cells[1][0]
    assert cells[1][1:] == ["15.0 (10.0 to 20.0)"] * 3 + ["15.0"]
    assert cells[-1][1:] == ["2.5 (1.0 to 4.0)"] * 3 + ["2.5"]


def test_a_difference_is_claimed_only_where_all_bands_agree(same) -> None:
    text = headline.differences(same)
    assert "on the same 2 recordings" in text and text.endswith("all bands agree.")
    assert "misses by +10.0, +10.0 and +10.0 cm more" in text
    near = {"methods": {name: {"miss_cm_each": [1.0]} for name in (PAPER, POSTERIOR)}}
    near["methods"][POSTERIOR] = {"miss_cm_each": [0.5]}
    text = headline.differences({"figures": same["figures"] | {"band1": near}})
    assert "−0.5, +10.0 and +10.0 cm" in text and text.endswith("no difference is shown.")
