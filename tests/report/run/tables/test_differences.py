"""What is said of differences."""

import numpy as np
import pytest

from pipeline.report.drawing.styles import styles
from pipeline.report.run.tables.differences import as_table, compared, records
from tests.report.run.tables.toy_results import launches, ran

REFERENCES = "least_squares", "sling2sim2real"
NOISE = np.random.default_rng(0).normal(0, 0.01, (3, 5))
NAMED = styles(["sling2sim2real", "least_squares", "package_si", "real2sim2real"])
RAN = ran(
    {
        "band1 sling2sim2real": launches(0.05 - NOISE),
        "band1 least_squares": launches(0.05 + NOISE),
        "band1 package_si": launches(0.2 + NOISE),
        "band1 real2sim2real": launches(NOISE, failed=15),
        "orange package_si": launches(NOISE, "measured"),
    }
)


def test_methods_are_held_against_ours_and_the_papers() -> None:
    heads, rows = as_table(compared(RAN, REFERENCES, 1), NAMED)
    assert heads[3:] == ["beside Sling2Sim2Real", "beside ours"]
    table = {row[1]: row[2:] for row in rows}
    assert table["Sling2Sim2Real"][1] == table["ours"][2] == "–"
    assert table["Package SI"][2] == "**+15.00 (+15.00 to +15.00)**"
    assert table["Real2Sim2Real"] == ["virtual", "N/A", "N/A"]
    assert table["ours"][1].count("+") + table["ours"][1].count("−") == 3
    assert not any(row[0] == "orange" for row in rows)  # none of the two ran there


def test_machines_read_the_same(tmp_path) -> None:
    read = records(compared(RAN, REFERENCES, 1)).set_index(["method", "beside"])
    row = read.loc["package_si", "least_squares"]
    assert row.difference_cm == pytest.approx(15) and row.launches == 15 and row.left_out == 0
    assert (row.launches_beside, row.failed_share, row.failed_share_beside) == (15, 0, 0)
    assert row.low_95_cm <= 15.001 and row.high_95_cm >= 14.999
    assert ("real2sim2real", "least_squares") not in read.index
    some = launches(NOISE, "measured", failed=3), launches(NOISE, "measured", failed=6)
    both = ran({"band1 sling2sim2real": some[0], "band1 bo": some[1]})
    (few,) = records(compared(both, REFERENCES, 1)).itertuples()
    assert (few.launches, few.launches_beside) == (9, 10)  # of the two targets that both reach
    assert few.failed_share == pytest.approx(0.4) and few.failed_share_beside == pytest.approx(0.2)
