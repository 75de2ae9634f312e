"""Parts of an episode, and blocks that are held out of the pull."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from pipeline.base.errors import UserError
from pipeline.episode.phases import held_out_blocks, phases, reach, taut_frames, within
from pipeline.episode.signal import average, lowpass
from tests.identify.search import toy

RELEASE = 2.4


def pull(**changes):
    """Weight of 0.3 N until 1.5 s, a ramp to 12 N at 1.9 s, let go at 2.4 s."""
    time = toy.PERIOD * (np.arange(120) + 0.5)
    force = np.zeros((120, 3))
    force[:, 1] = np.where(time < RELEASE, np.clip(0.3 + (time - 1.5) * 30, 0.3, 12), 0)
    return toy.episode(samples=120, force=force, release_time=RELEASE, **changes)


def recoil(y) -> dict:
    clouds = [toy.facing() + [0, value, 0] for value in y]
    return {"clouds": clouds, "cloud_time": RELEASE + 0.02 * np.arange(len(y))}


def test_phases_of_a_pull() -> None:
    """Taut from 0.6 + 0.45 N on (of its peak and its weight); the recoil until y = 0."""
    found = phases(pull(**recoil([-0.4, -0.3, -0.1, 0.02, 0.1, -0.05])))
    assert list(found) == ["slack", "taut", "recoil", "swing"]
    bounds = [*(begin for begin, _ in found.values()), found["swing"][1]]
    np.testing.assert_allclose(bounds, [0, 1.545, 2.4, 2.46, 3.6], atol=1e-9)
    assert [end for _, end in found.values()] == bounds[1:]


def test_a_recoil_that_no_frame_ends() -> None:
    """Soft or unseen, it is over after 0.2 s."""
    unseen = pull(cloud_time=np.array([0.5]), clouds=[toy.facing()])
    assert phases(unseen)["recoil"] == pytest.approx((2.4, 2.6))


def test_a_hand_that_feels_nothing_is_refused() -> None:
    with pytest.raises(UserError, match="never rises"):
        phases(toy.episode())


def test_recoil_with_frames_that_do_not_show_the_middle() -> None:
    """An empty frame decides nothing; late frames never count."""
    content = recoil([-0.4, -0.3, -0.2, -0.1, -0.05])
    content["clouds"][1] = np.zeros((0, 3))
    content["cloud_time"][4] = 3.4
    np.testing.assert_array_equal(taut_frames(pull(**content)), [0, 1, 1, 1, 0])


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
