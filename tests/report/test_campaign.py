"""A campaign's JSON becomes a table; another file is refused in one line."""

import json

import pytest

from pipeline.report.tables.campaign import ABLATIONS, campaign_table
from sling2sim2real.base.errors import UserError
from tests.project import ROOT


def test_the_committed_campaign() -> None:
    """The cells are the file's own means and intervals."""
    heads, rows = campaign_table(ROOT / ABLATIONS)
    assert heads == ["method", "Band 1 (soft)", "Band 2 (medium)", "Band 3 (stiff)", "all"]
    figures = json.loads((ROOT / ABLATIONS).read_text())["figures"]
    miss = figures["band2"]["methods"]["package_si"]["miss_cm"]
    row = next(row for row in rows if row[0] == "Package SI")
    assert row[2] == f"{miss['mean']:.1f} ({miss['low']:.1f} to {miss['high']:.1f})"
    assert len(rows) == 4 and all(len(row) == 5 for row in rows)


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"figures": {"all": 1}}'])
def test_another_file(tmp_path, content) -> None:
    path = tmp_path / "ablations.json"
    assert campaign_table(path) is None
    path.write_text(content)
    with pytest.raises(UserError, match="ablations.json: is no campaign's"):
        campaign_table(path)
