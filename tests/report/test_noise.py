"""Intervals of differences: against SciPy, by enumeration, and how often they hold the truth."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from pipeline.report import noise
from pipeline.report.noise import difference
from tests.report.toy_launches import launches

ONE = [1.925]


def interval(result) -> tuple[float, float]:
    return result.low, result.high


@pytest.mark.parametrize("kind", ["virtual", "measured"])
def test_many_launches_give_scipys_interval(kind: str) -> None:
    """Pairs as a paired t-test and SciPy's bootstrap; else as for two samples."""
    rng = np.random.default_rng(3)
    shared = rng.normal(0, 0.02, 200)
    first, second = 0.10 + shared, 0.12 + shared + rng.normal(0, 0.005, 200)
    result = difference(launches([first], kind, ONE), launches([second], kind, ONE), seed=1)
    assert result.mean == pytest.approx((second - first).mean())
    paired = kind == "virtual"
    test = stats.ttest_rel(second, first) if paired else stats.ttest_ind(second, first)
    again = stats.bootstrap(
        (second, first),
        lambda a, b, axis: a.mean(axis) - b.mean(axis),
        paired=paired,
        vectorized=True,
        method="percentile",
        rng=np.random.default_rng(0),
    )
    width = result.high - result.low
    for other in (test.confidence_interval(0.95), again.confidence_interval):
        assert interval(result) == pytest.approx((other.low, other.high), abs=0.04 * width)
    assert result.real == (test.pvalue < 0.05)


def test_pairs_see_what_their_errors_hide() -> None:
    """1 cm between launches that share errors of 5 cm."""
    shared = np.random.default_rng(1).normal(0, 0.05, (3, 5))
    first, second = 0.2 + shared, 0.21 + shared
    pairs = difference(launches(first), launches(second), seed=1)
    alone = difference(launches(first, "measured"), launches(second, "measured"), seed=1)
    assert pairs.mean == pytest.approx(0.01) and alone.mean == pytest.approx(0.01)
    assert pairs.real and interval(pairs) == pytest.approx((0.01, 0.01))
    assert not alone.real


def test_three_pairs_by_enumeration() -> None:
    """Two draws of three with replacement: nine equally likely means."""
    change = np.array([0.01, 0.02, 0.06])
    means = [np.mean(pair) for pair in itertools.product(change, repeat=2)]
    result = difference(
        launches([[0.1] * 3], targets=ONE), launches([0.1 + change], targets=ONE), 1
    )
    assert interval(result) == pytest.approx((min(means), max(means)))
    # their variance is that of the mean of three, unbiased
    assert np.var(means) == pytest.approx(np.var(change, ddof=1) / 3)


def test_a_target_counts_as_much_as_another_and_keeps_its_own_launches() -> None:
    """Differences between targets are no noise: 10 cm here and 30 cm there give no width."""
    zero, far = launches([[0.0] * 5] * 2, targets=[1.7, 1.9]), [[0.1] * 5, [0.3] * 5]
    result = difference(zero, launches(far, targets=[1.7, 1.9]), 1)
    assert result.mean == pytest.approx(0.2) and interval(result) == pytest.approx((0.2, 0.2))


def test_failures_are_left_out_with_their_pairs() -> None:
    first, second = launches([[0.0] * 5] * 3), launches([[0.1, 0.1, 0.1, 0.1, 0.9]] * 3)
    result = difference(first, second, 1)  # the last of each target leaves the area or not
    inside = second.landing_y <= 2.425
    assert result.launches == (int(inside.sum()),) * 2
    assert result.left_out == 2 * int((~inside).sum())
    assert result.failed == (0.0, pytest.approx((~inside).mean()))
    assert difference(first, launches([[0.1] * 5] * 3, failed=15), 1) is None
    assert difference(first.iloc[:0], first, 1) is None


def test_measured_launches_are_compared_where_both_aimed() -> None:
    first = launches([[0.1, 0.1], [0.5, 0.5]], "measured", targets=[1.7, 1.9])
    second = launches([[0.2, 0.2, 0.2]], "measured", targets=[1.7])
    result = difference(first, second, 1)
    assert result.mean == pytest.approx(0.1) and result.launches == (2, 3) and result.left_out == 2


@given(st.integers(0, 2**32 - 1), st.floats(-0.05, 0.05))
def test_to_and_fro_are_opposite_and_seeded(seed: int, shift: float) -> None:
    errors = np.random.default_rng(seed).normal(0, 0.02, (3, 5))
    first, second = launches(0.1 + errors), launches(0.1 + shift + errors[::-1])
    there, back = difference(first, second, 7), difference(second, first, 7)
    assert there == difference(first, second, 7)
    assert there.mean == pytest.approx(-back.mean)
    assert interval(there) == pytest.approx((-back.high, -back.low), abs=1e-12)


def test_how_often_the_interval_holds_the_truth(monkeypatch) -> None:
    """95 %, within three deviations of 300 tries; plain percentiles would hold it in 90 %."""
    monkeypatch.setattr(noise, "RESAMPLES", 1000)
    rng = np.random.default_rng(5)
    zero = launches(np.full((3, 5), 0.2))
    held = 0
    for _ in range(300):
        result = difference(zero, launches(0.2 + rng.normal(0.01, 0.02, (3, 5))), 1)
        held += result.low <= 0.01 <= result.high
    assert 0.912 <= held / 300 <= 0.988
