"""Blocks that are held out of the pull."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pipeline.base.errors import UserError
from pipeline.episode.blocks import held_out_blocks, reach, within
from pipeline.episode.signal import average, lowpass
from tests.identify.search import toy


@given(st.integers(1, 8), st.floats(0.5, 2.0), st.floats(0, 0.3), st.floats(2.0, 20.0))
def test_blocks_and_their_guards_lie_apart_within_the_pull(blocks, length, guard, pull) -> None:
    assume(blocks * (length + 2 * guard) <= pull / 2)
    episode = toy.episode(grasp_time=0.9, release_time=0.9 + pull)
    low, high = held_out_blocks(episode, blocks, length, guard).T
    np.testing.assert_allclose(high - low, length)
    assert len(low) == blocks
    assert np.all(low[1:] - high[:-1] > 2 * guard)
    assert low[0] - guard >= 0.9
    assert high[-1] + guard <= episode.release_time + 1e-9


def test_no_blocks() -> None:
    blocks = held_out_blocks(toy.episode(), 0, 0.6, 0.1)
    assert blocks.shape == (0, 2)
    assert not within(np.arange(5.0), blocks, 1.0).any()


def test_half_of_the_pull_stays_for_the_fit() -> None:
    episode = toy.episode(grasp_time=1.0, release_time=5.0)
    held_out_blocks(episode, 2, 0.6, 0.15)  # 1.8 s
    with pytest.raises(UserError, match=r"held_out: 3 blocks .* leave out 2.7 s of the 4.0 s"):
        held_out_blocks(episode, 3, 0.6, 0.15)


@pytest.mark.parametrize("cutoff", [8.0, 35.65, 200.0])
def test_nothing_of_a_block_reaches_beyond_its_guard(cutoff: float) -> None:
    """Whatever 1 N the force does within the block, a thousandth of it is left beyond the guard."""
    period, samples, window = 0.03, 200, 7
    time = period * (np.arange(samples) + 0.5)
    block = np.array([[2.5, 3.5]])
    times = np.arange(0, 6.0, 1e-3)
    inside = within(times, block)
    beyond = ~within(time, block, reach(period, cutoff, window))
    near = ~within(time, block)
    rng = np.random.default_rng(0)
    for raw in (np.ones(len(times)), np.sign(rng.normal(size=len(times)))):
        record = average(times, lowpass(raw * inside, 1000.0, cutoff), 0.0, period, samples)
        # A sample beyond takes part in no median with samples that the block has changed.
        changed = np.flatnonzero(np.abs(record) > 1e-3)
        medians = np.abs(np.flatnonzero(beyond)[:, None] - changed) <= window // 2
        assert not medians.any()
        assert np.abs(record[beyond]).max() < 1e-3
    assert np.abs(record[near]).max() > 1e-3 or cutoff > 100  # it is the guard that keeps it out
