"""The word on a change: rarely without one, surely with a large one, and in no unit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.drift.change import FALSE_ALARM, ValueOfRecording, changes, newest

NINE_OF_TEN = 1.645  # standard deviations on either side


def value(log: float, deviation: float) -> ValueOfRecording:
    ends = np.exp(log + NINE_OF_TEN * deviation * np.array([-1, 0, 1]))
    low, middle, high = map(float, ends)
    return ValueOfRecording(value=middle, low=low, high=high, deviation=deviation)


def sampled(rng, logs, deviations) -> list[ValueOfRecording]:
    """What recordings say whose errors are normal, of truths whose logarithms are `logs`."""
    return [
        value(log + deviation * rng.normal(), deviation)
        for log, deviation in zip(logs, deviations, strict=True)
    ]


@pytest.mark.parametrize("count", [2, 6])
def test_a_band_that_keeps_is_rarely_said_to_change(count) -> None:
    """At most FALSE_ALARM of bands; 2000 of them, so four standard errors are 2 %."""
    rng = np.random.default_rng(1)
    deviations = np.linspace(0.01, 0.03, count)
    alarms = [
        bool(changes({name: sampled(rng, [12.0] * count, deviations) for name in ("e", "d")}))
        for _ in range(2000)
    ]
    assert 0.005 < np.mean(alarms) < FALSE_ALARM + 0.02


def test_a_change_of_five_combined_deviations_is_said() -> None:
    rng = np.random.default_rng(2)
    deviations = [0.01, 0.02, 0.02]
    step = -5 * np.hypot(0.01, 0.02)
    for _ in range(200):
        result = changes({"e": sampled(rng, [12, 12 + step, 12 + step], deviations)})
        assert result and result[0].earlier == 0 and result[0].ratio < 1
    many = [changes({"e": sampled(rng, [12, 12, 12 + step], deviations)}) for _ in range(200)]
    assert np.mean([newest(trial) == 2 for trial in many]) > 0.9


def test_it_is_no_question_of_overlap() -> None:
    """Of two intervals that overlap a little, the difference can be sure; among many pairs less."""
    apart = 2.4 * np.sqrt(2) * 0.01  # tail 0.0164, as tables of the normal distribution have it
    assert apart < 2 * NINE_OF_TEN * 0.01 + 0.002
    pair = [value(12.0, 0.01), value(12.0 + apart, 0.01)]
    (change,) = changes({"e": pair})
    assert change.chance == pytest.approx(0.0164, abs=1e-4)
    assert change.ratio == pytest.approx(np.exp(apart))
    between = value(12.0 + apart / 2, 0.01)
    assert changes({"e": [*pair, between], "d": [pair[0]] * 3}) == []


def test_the_surest_comes_first_and_the_newest_are_those_at_the_end() -> None:
    logs = [0.0, 0.0, 0.5, 0.9, 0.9]
    result = changes({"e": [value(log, 0.02) for log in logs]})
    assert result[0].ratio == pytest.approx(np.exp(0.9))
    assert len(result) == 8 and newest(result) == 3
    assert newest([]) == 0


values = st.tuples(st.floats(-3, 3), st.floats(1e-3, 1.0))


@given(st.lists(values, min_size=2, max_size=6), st.floats(1e-6, 1e6))
def test_neither_units_nor_the_direction_of_time_matter(message, unit) -> None:
    series = [value(*pair) for pair in message]
    result = changes({"e": series})
    assert all(change.chance < FALSE_ALARM and change.earlier < change.later for change in result)
    other = [reading.model_copy(update={"value": unit * reading.value}) for reading in series]
    back = changes({"e": series[::-1]})
    last = len(series) - 1
    pairs = {
        (change.earlier, change.later) for change in result if change.chance < 0.99 * FALSE_ALARM
    }
    assert pairs <= {(change.earlier, change.later) for change in changes({"e": other})}
    assert pairs <= {(last - change.later, last - change.earlier) for change in back}
