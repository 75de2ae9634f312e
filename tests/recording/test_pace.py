"""Bursts of stamps and held values, made of samples whose true times are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording import pace

MS = 1_000_000


def samples(count: int = 4000, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """True times of a 1 kHz sensor [ns], and its noisy values."""
    random = np.random.default_rng(seed)
    return 10**18 + np.arange(count) * MS, random.normal(size=(count, 3))


@given(
    size=st.one_of(st.integers(2, 40), st.sampled_from([64, 250])),
    width=st.sampled_from([0, 8_000, 60_000]),
    late=st.sampled_from([0, 200_000]),
    lost=st.lists(st.integers(10, 90), max_size=3),
    seed=st.integers(0, 99),
)
def test_bursts_are_spread_back_to_where_samples_were_taken(size, width, late, lost, seed) -> None:
    """Whatever their size, with a jitter of the reader, and where whole bursts are lost."""
    true, values = samples(seed=seed)
    random = np.random.default_rng(seed)
    burst = np.arange(len(true)) // size
    end = np.array([true[burst == k][-1] for k in range(burst[-1] + 1)])
    end = end + random.integers(0, late + 1, len(end))
    stamp = end[burst] + (np.arange(len(true)) % size) * min(width, MS // 8 // size)
    retained = ~np.isin(burst, [number * (burst[-1] // 100) for number in lost])
    stamp, true, values = stamp[retained], true[retained], values[retained]
    even, bursts = pace.without_bursts("/x", stamp, stamp + 100_000, values)
    assert bursts.count == size
    whole = slice(size, len(true) - size)
    assert np.abs(even - true)[whole].max() < MS / 2 + 1.5 * late
    assert np.all(np.diff(even) > 0)


def test_a_coarse_clock_is_refused() -> None:
    true, values = samples()
    with pytest.raises(UserError, match="/x: its clock ticks every 10 ms only"):
        pace.without_bursts("/x", true // (10 * MS) * (10 * MS), true + 150_000, values)


@given(
    rate=st.sampled_from([30.0, 100.0, 1000.0]),
    jitter=st.floats(0, 0.3),
    lost=st.floats(0, 0.5),
    seed=st.integers(0, 999),
)
def test_even_stamps_are_left(rate, jitter, lost, seed) -> None:
    random = np.random.default_rng(seed)
    stamp = np.arange(3000) / rate + jitter / rate * random.uniform(-1, 1, 3000)
    stamp = np.sort(np.round(1e9 * stamp[random.random(3000) >= lost]).astype(np.int64))
    values = random.normal(size=(len(stamp), 3))
    assert pace.without_bursts("/x", stamp, stamp, values) is None
    assert pace.hold_of(stamp, values) is None


def test_doubled_messages_are_no_bursts() -> None:
    true, values = samples()
    twice = np.repeat(true, 2)
    assert pace.without_bursts("/x", twice, twice + 1000, np.repeat(values, 2, axis=0)) is None


@given(times=st.integers(2, 60), jitter=st.floats(0, 0.2), rests=st.booleans())
def test_held_values_are_taken_once(times, jitter, rests) -> None:
    """Also of a hand that rests, without noise, half of the time."""
    count = 6000
    random = np.random.default_rng(times)
    stamp = np.round(MS * (np.arange(count) + jitter * random.uniform(-1, 1, count))).astype(int)
    source = np.arange(count) // times * times
    path = np.where(rests & (source < count // 2), 0.0, (source - count / 2) ** 2)
    values = np.stack([path, 0 * path], axis=1)
    hold = pace.hold_of(stamp, values)
    assert hold == pytest.approx(times * MS, rel=0.02)
    retained = pace.first_of_each(stamp, values, hold)
    moving = np.flatnonzero(retained & (np.arange(count) > count // 2 + times))
    np.testing.assert_array_equal(moving % times, 0)
    assert np.diff(stamp[retained]).max() < 2.5 * times * MS  # a rest is no gap


def test_a_coarse_encoder_is_not_held() -> None:
    """It steps by its resolution, at a pace that goes with the speed."""
    t = np.arange(5000)
    path = np.round(400 * np.sin(t / 900)) / 400
    assert pace.hold_of(t * MS, path[:, None]) is None
