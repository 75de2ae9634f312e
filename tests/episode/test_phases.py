"""Phases of interactions whose hand is led along known knots."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sling2sim2real.base.errors import UserError
from sling2sim2real.episode.phases import (
    NO_UNLOADING,
    InteractionPhase,
    phases,
    phases_of_hand,
    taut_frames,
    taut_time,
    turns,
    unseen,
)
from tests.episode import led
from tests.identification.objective import toy

RELEASE = 2.4
OFTEN = [(0.0, 0.0), (2e-4, 0.0), (2e-4, 0.002), (5e-4, 0.0)]  # noise and wander of hands


def pull(**changes):
    """Weight of 0.3 N until 1.5 s, a ramp to 12 N at 1.9 s, let go at 2.4 s."""
    time = toy.PERIOD * (np.arange(120) + 0.5)
    force = np.zeros((120, 3))
    force[:, 1] = np.where(time < RELEASE, np.clip(0.3 + (time - 1.5) * 30, 0.3, 12), 0)
    return toy.episode(samples=120, force=force, release_time=RELEASE, **changes)


def recoil(y) -> dict:
    clouds = [toy.facing() + [0, value, 0] for value in y]
    return {"clouds": clouds, "cloud_time": RELEASE + 0.02 * np.arange(len(y))}


def kinds(sequence: list[InteractionPhase]) -> list[str]:
    return [phase.kind for phase in sequence]


def test_the_force_rises_beyond_the_bands_weight() -> None:
    """From 0.6 + 0.45 N on: of its peak and its weight."""
    assert taut_time(pull()) == pytest.approx(1.545)


def test_a_recoil_ends_as_the_band_passes_the_fork() -> None:
    sequence = phases(pull(**recoil([-0.4, -0.3, -0.1, 0.02, 0.1, -0.05])))
    assert kinds(sequence)[-2:] == ["recoil", "swing"]
    np.testing.assert_allclose(
        [sequence[-2].begin, sequence[-2].end, sequence[-1].end], [2.4, 2.46, 3.6]
    )


def test_a_recoil_that_no_frame_ends() -> None:
    """Soft or unseen, it is over after 0.2 s."""
    unseen_recoil = pull(cloud_time=np.array([0.5]), clouds=[toy.facing()])
    assert phases(unseen_recoil)[-2].end == pytest.approx(2.6)


def test_a_hand_that_feels_nothing_has_no_phases() -> None:
    assert phases(toy.episode()) == []
    with pytest.raises(UserError, match="never rises"):
        taut_time(toy.episode())


def test_recoil_with_frames_that_do_not_show_the_middle() -> None:
    """An empty frame decides nothing; late frames never count."""
    content = recoil([-0.4, -0.3, -0.2, -0.1, -0.05])
    content["clouds"][1] = np.zeros((0, 3))
    content["cloud_time"][4] = 3.4
    np.testing.assert_array_equal(taut_frames(pull(**content)), [0, 1, 1, 1, 0])


@pytest.mark.parametrize(("noise", "wander"), OFTEN)
@pytest.mark.parametrize(
    ("knots", "expected"),
    [
        (led.MONOTONE, "loading pause"),
        (led.DIP, "loading unloading reloading pause"),
        (led.FAST, "loading unloading reloading pause"),
        (led.ON_THE_WAY, "loading unloading reloading loading pause"),
        (led.CYCLES, "loading unloading reloading unloading reloading pause"),
        (((1.2, 0.0), (3, 0.4), (4, 0.4), (5, 0.3), (6, 0.3), (7, 0.4)),
         "loading pause unloading pause reloading"),
        (((1.2, 0.0), (3, 0.4), (4, 0.35), (6, 0.35)), "loading unloading pause"),
        (((1.2, 0.0), (3, 0.3), (5, 0.3), (6, 0.4), (7, 0.4)), "loading pause loading pause"),
    ],
)  # fmt: skip
def test_what_the_hand_does_is_told_from_its_path(knots, expected, noise, wander) -> None:
    assert kinds(phases_of_hand(led.episode(knots, noise, wander))) == expected.split()


def test_times_ways_and_speeds_of_a_dip() -> None:
    loading, back, again, pause = phases_of_hand(led.episode(led.DIP, 2e-4))
    assert loading.start == pytest.approx(led.TAUT, abs=0.03)
    np.testing.assert_allclose([loading.stop, again.stop, pause.stop], 0.4, atol=2e-3)
    assert back.stop == again.start == pytest.approx(0.3, abs=2e-3)
    for phase, begin in ((back, 5.2), (again, 6.2), (pause, 7.2)):
        assert phase.begin == pytest.approx(begin, abs=0.12)
    assert back.speed == pytest.approx(0.1, rel=0.15)
    assert pause.end == 9.2


@given(st.floats(0.02, 0.15), st.floats(0.2, 2.0), st.floats(0.2, 2.0), st.floats(0.4, 3.0))
@example(0.0234375, 2.0, 0.21875, 1.0)  # turns while it creeps
@example(0.02, 2.0, 1.0, 1.0)  # as slow as a dip here may be
def test_any_dip_of_two_centimetres_is_seen(depth, out, back, pause) -> None:
    low, again = 4.2 + out, 4.2 + out + back
    knots = ((1.2, 0.0), (4.2, 0.4), (low, 0.4 - depth), (again, 0.4), (again + pause, 0.4))
    sequence = phases_of_hand(led.episode(knots, 2e-4, 0.001))
    (unloading,) = [phase for phase in sequence if phase.kind == "unloading"]
    assert unloading.way == pytest.approx(depth, abs=4e-3)
    ends = [phase.begin for phase in sequence[1:]]
    assert ends == pytest.approx([phase.end for phase in sequence[:-1]])  # no gap, no overlap


def test_what_a_recording_does_not_show() -> None:
    assert [what.split()[1] for what in unseen(phases_of_hand(led.episode(led.MONOTONE)))] == [
        "unloading", "speed",
    ]  # fmt: skip
    assert NO_UNLOADING not in unseen(phases_of_hand(led.episode(led.DIP)))
    assert not unseen(phases_of_hand(led.episode(led.FAST)))
    short = ((1.2, 0.0), (4.2, 0.4), (4.5, 0.4))
    assert "no pause of 0.5 s" in unseen(phases_of_hand(led.episode(short)))
    assert len(unseen([])) == 3


@given(st.lists(st.floats(0.02, 0.3), min_size=1, max_size=7), st.integers(0, 2**32 - 1))
def test_turns_are_those_of_a_zigzag(steps, seed) -> None:
    """A zigzag, finely sampled and with noise of a tenth of what counts."""
    ends = np.concatenate([[0], np.cumsum(np.array(steps) * (-1.0) ** np.arange(len(steps)))])
    way = np.interp(np.arange(0, len(steps) + 1e-9, 0.02), np.arange(len(ends)), ends)
    way += np.random.default_rng(seed).uniform(-1e-3, 1e-3, len(way))
    indices = turns(way)
    assert len(indices) == len(ends)
    np.testing.assert_allclose(way[indices], ends, atol=2e-3)
