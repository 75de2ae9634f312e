"""What is said of differences."""

import numpy as np
import pytest

from pipeline.drawing.styles import styles
from pipeline.report.tables.differences import as_table, claims, compared, records
from tests.report.tables.toy_results import launches, ran

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
    heads, rows = as_table(compared(RAN, 1), NAMED)
    assert heads[3:] == ["beside ours", "beside Sling2Sim2Real"]
    found = {row[1]: row[2:] for row in rows}
    assert found["Sling2Sim2Real"][2] == found["ours"][1] == "–"
    assert found["Package SI"][1] == "**+15.00 (+15.00 to +15.00)**"
    assert found["Real2Sim2Real"] == ["virtual", "N/A", "N/A"]
    assert found["ours"][2].count("+") + found["ours"][2].count("−") == 3
    assert not any(row[0] == "orange" for row in rows)  # none of the two ran there


def test_no_more_is_said_than_the_intervals_allow() -> None:
    beside_ours, beside_papers = claims(compared(RAN, 1), NAMED)
    assert beside_ours == (
        "- Band 1 (soft), virtual, beside **ours**: more error: Package SI; cannot be told"
        " apart: Sling2Sim2Real; cannot be compared: Real2Sim2Real."
    )
    assert "beside **Sling2Sim2Real**" in beside_papers


def test_what_is_said_where_launches_fail() -> None:
    """How few count, of the method that is named; who fails more is never just better."""
    near, far = 0.1 + NOISE, 0.2 + NOISE
    better, worse = launches(near), launches(far)
    half, count = launches(near, failed=13), "Package SI (2 launches count)."
    few = launches(NOISE, "measured", failed=1), launches(far, "measured", failed=8)
    for reference, other, verdict in (
        (worse, better, "less error: Package SI."),
        (*few, "more error: Package SI (7 launches count)."),
        (worse, half, f"less error where it lands, but more launches fail: {count}"),
        (half, worse, f"more error where both land, but fewer launches fail: {count}"),
    ):
        found = ran({"band1 sling2sim2real": reference, "band1 package_si": other})
        kind = reference.kind[0]
        beside = f"- Band 1 (soft), {kind}, beside **Sling2Sim2Real**: "
        assert claims(compared(found, 1), NAMED) == [beside + verdict]


def test_machines_read_the_same(tmp_path) -> None:
    read = records(compared(RAN, 1)).set_index(["method", "beside"])
    one = read.loc["package_si", "least_squares"]
    assert one.difference_cm == pytest.approx(15) and one.launches == 15 and one.left_out == 0
    assert (one.launches_beside, one.failed_share, one.failed_share_beside) == (15, 0, 0)
    assert one.low_95_cm <= 15.001 and one.high_95_cm >= 14.999
    assert ("real2sim2real", "least_squares") not in read.index
    some = launches(NOISE, "measured", failed=3), launches(NOISE, "measured", failed=6)
    both = ran({"band1 sling2sim2real": some[0], "band1 bo": some[1]})
    (few,) = records(compared(both, 1)).itertuples()
    assert (few.launches, few.launches_beside) == (9, 10)  # of the two targets that both reach
    assert few.failed_share == pytest.approx(0.4) and few.failed_share_beside == pytest.approx(0.2)
