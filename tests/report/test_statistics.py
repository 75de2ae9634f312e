"""Numbers of the tables by hand, and intervals of differences against SciPy and the truth."""

import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from pipeline.report.data import with_errors
from pipeline.report.statistics import ALL, difference, landing_errors, prediction_errors
from pipeline.report.tables import launches as launch_table
from pipeline.report.tables import markdown
from tests.report.toy_launches import launches as toy

ONE = [1.925]


def launches(*arguments, **named) -> pd.DataFrame:
    return with_errors(toy(*arguments, **named))


def trials(rows: list[tuple]) -> pd.DataFrame:
    """Rows of target, landing, failure, predicted, stretch."""
    frame = pd.DataFrame(rows, columns=["target", "landing_y", "failure", "predicted_y", "stretch"])
    more = {"draw_y": -0.3, "draw_z": -0.2, "hold_force": 9.0, "predicted_failure": None}
    more |= {"predicted_low": math.nan, "predicted_high": math.nan, "recorded_stretch": 1.6}
    names = {"name": "band", "band": "band", "method": "mine", "kind": "measured"}
    return with_errors(frame.assign(**names, **more))


def test_landing_errors_by_hand() -> None:
    launched = trials(
        [
            (1.9, 1.90 + 0.01, None, 1.9, 1.4),
            (1.9, 1.90 - 0.03, None, 1.9, 1.4),
            (2.1, 2.10 + 0.10, None, 2.1, 1.4),
            (2.1, 2.10 + 0.14, None, 2.1, 1.4),
            (2.1, math.nan, "holding takes 31 N", 2.1, 1.4),
            (2.1, 2.50, None, 2.1, 1.4),  # beyond the target area
            (math.nan, 1.0, None, 1.1, 1.4),  # aimed at nothing
        ]
    )
    errors = landing_errors(launched).set_index("target")
    near, far, total = (errors.loc[target] for target in (1.9, 2.1, ALL))
    assert (near.launches, near.failed) == (2, 0)
    assert near["mean"] == pytest.approx(0.02) and near.bias == pytest.approx(-0.01)
    assert near["std"] == pytest.approx(0.02 / math.sqrt(2))
    assert (far.launches, far.failed) == (4, 2)
    assert far["mean"] == pytest.approx(0.12)
    assert far["std"] == pytest.approx(0.04 / math.sqrt(2))
    assert (total.launches, total.failed) == (6, 2)
    assert total["mean"] == pytest.approx(0.07) and total.bias == pytest.approx(0.055)
    assert total.within == pytest.approx(math.sqrt((0.02**2 / 2 + 0.04**2 / 2) / 2))
    deviations = [0.01 - 0.07, 0.03 - 0.07, 0.10 - 0.07, 0.14 - 0.07]
    assert total["std"] == pytest.approx(math.sqrt(sum(d**2 for d in deviations) / 3))


def test_prediction_errors_by_hand() -> None:
    launched = trials(
        [
            (math.nan, 2.0, None, 2.1, 1.4),  # + 5 %
            (math.nan, 2.0, None, 1.98, 1.6),  # - 1 %, at the limit
            (math.nan, 4.0, None, 3.6, 1.7),  # - 10 %
            (math.nan, 4.0, None, math.nan, 1.9),  # no prediction
        ]
    )
    inside, beyond = (
        prediction_errors(launched[launched.inside == side]) for side in (True, False)
    )
    assert (inside["compared"], beyond["compared"]) == (2, 1)
    assert inside["mean"] == pytest.approx(0.03) and inside["bias"] == pytest.approx(0.02)
    assert beyond["most"] == pytest.approx(0.10) and beyond["bias"] == pytest.approx(-0.10)
    assert (beyond["unpredicted"], beyond["tried"], inside["unpredicted"]) == (1, 2, 0)
    assert prediction_errors(launched)["mean"] == pytest.approx(0.16 / 3)
    ranged = launched.assign(predicted_low=[1.9, 2.01, math.nan, 3.0], predicted_high=2.2)
    found = prediction_errors(ranged)
    assert (found["ranged"], found["covered"]) == (3, 1)
    assert found["width"] == pytest.approx(0.19 / 2)
    text = markdown(launch_table(launched))
    assert "+5.0%" in text and "−10.0%" in text and text.count("(beyond)") == 2


@pytest.mark.parametrize("kind", ["virtual", "measured"])
def test_at_one_target_the_interval_is_scipys(kind: str) -> None:
    """Pairs as a paired t-test; else as Welch's for two samples."""
    rng = np.random.default_rng(3)
    shared = rng.normal(0, 0.02, 20)
    first, second = 0.10 + shared, 0.12 + shared + rng.normal(0, 0.005, 20)
    found = difference(launches([first], kind, ONE), launches([second], kind, ONE))
    assert found["mean"] == pytest.approx((second - first).mean())
    test = (
        stats.ttest_rel(second, first)
        if kind == "virtual"
        else stats.ttest_ind(second, first, equal_var=False)
    ).confidence_interval(0.95)
    assert (found["low"], found["high"]) == pytest.approx((test.low, test.high))


def test_pairs_see_what_their_errors_hide() -> None:
    """1 cm between launches that share errors of 5 cm."""
    shared = np.random.default_rng(1).normal(0, 0.05, (3, 5))
    first, second = 0.2 + shared, 0.21 + shared
    pairs = difference(launches(first), launches(second))
    alone = difference(launches(first, "measured"), launches(second, "measured"))
    assert pairs["mean"] == pytest.approx(0.01) and alone["mean"] == pytest.approx(0.01)
    assert pairs["low"] == pytest.approx(0.01) and alone["low"] < 0 < alone["high"]


def test_a_target_counts_as_much_as_another_and_keeps_its_own_launches() -> None:
    """Differences between targets are no noise: 10 cm here and 30 cm there give no width."""
    zero, far = launches([[0.0] * 5] * 2, targets=[1.7, 1.9]), [[0.1] * 5, [0.3] * 5]
    found = difference(zero, launches(far, targets=[1.7, 1.9]))
    assert [found[name] for name in ("mean", "low", "high")] == pytest.approx([0.2] * 3)


def test_failures_are_left_out_with_their_pairs() -> None:
    first, second = launches([[0.0] * 5] * 3), launches([[0.1, 0.1, 0.1, 0.1, 0.9]] * 3)
    found = difference(first, second)  # the last of each target leaves the area or not
    inside = second.landing_y <= 2.425
    assert found["launches"] == found["launches_beside"] == inside.sum()
    assert found["left_out"] == 2 * (~inside).sum()
    assert (found["failed_beside"], found["failed"]) == (0, pytest.approx((~inside).mean()))
    assert np.isnan(difference(first, launches([[0.1] * 5] * 3, failed=15))["mean"])
    single = difference(launches([[0.0]] * 3), launches([[0.1]] * 3))
    assert single["mean"] == pytest.approx(0.1) and np.isnan(single["low"])


def test_measured_launches_are_compared_where_both_aimed() -> None:
    first = launches([[0.1, 0.1], [0.5, 0.5]], "measured", targets=[1.7, 1.9])
    found = difference(first, launches([[0.2, 0.2, 0.2]], "measured", targets=[1.7]))
    assert found["mean"] == pytest.approx(0.1) and found["left_out"] == 2
    assert (found["launches_beside"], found["launches"]) == (2, 3)


@given(st.integers(0, 2**32 - 1), st.floats(-0.05, 0.05))
def test_to_and_fro_are_opposite(seed: int, shift: float) -> None:
    errors = np.random.default_rng(seed).normal(0, 0.02, (3, 5))
    first, second = launches(0.1 + errors), launches(0.1 + shift + errors[::-1])
    there, back = difference(first, second), difference(second, first)
    assert there["mean"] == pytest.approx(-back["mean"])
    assert there["low"] == pytest.approx(-back["high"])


@pytest.mark.parametrize("spread", [[0.02, 0.02, 0.02], [0.002, 0.02, 0.05]])
def test_how_often_the_interval_holds_the_truth(spread) -> None:
    """95 %, within three deviations of 300 tries; targets may spread alike or not."""
    rng = np.random.default_rng(5)
    targets, zero = [1.5, 1.6, 1.7], np.full((3, 5), 0.3)
    held = 0
    for _ in range(300):
        farther = rng.normal(0.01, np.array(spread)[:, None], (3, 5))
        found = difference(
            launches(zero, targets=targets), launches(0.3 + farther, targets=targets)
        )
        held += found["low"] <= 0.01 <= found["high"]
    assert 0.912 <= held / 300 <= 0.988
