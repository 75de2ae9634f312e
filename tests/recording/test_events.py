"""Grasp and release of made-up signals, whose times are known."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import UserError
from pipeline.recording.events import find_grasp, find_release

DIRECTION = np.array([0.3, -0.8, 0.52])


def pull(release: float, fall: float, noise: float, seed: int, rate: float = 1000.0):
    """Lead-in, pull to 12 N, hold, and a fall that takes `fall` seconds."""
    t = np.arange(0, 9, 1 / rate)
    held = 12 * np.clip((t - 2) / 3, 0, 1)
    left = np.clip(1 - (t - release) / fall, 0, 1) if fall else (t < release)
    force = (held * left)[:, None] * DIRECTION / np.linalg.norm(DIRECTION) + [3.0, -2.0, 7.0]
    return t, force + np.random.default_rng(seed).normal(0, noise, force.shape)


@pytest.mark.parametrize("fall", [0.0, 0.002, 0.005, 0.02])
@pytest.mark.parametrize("noise", [0.005, 0.05, 0.15])
def test_release_is_found_to_a_millisecond(fall, noise) -> None:
    for seed in range(10):
        release = 7.5 + 0.00037 * seed
        found = find_release(*pull(release, fall, noise, seed))
        assert abs(found.time - release) <= 1e-3
        assert found.drop == pytest.approx(12, rel=0.02)
        assert found.noise == pytest.approx(noise, rel=0.3)


def test_release_at_a_low_rate_says_so() -> None:
    found = find_release(*pull(7.5, 0.0, 0.02, 1, rate=100.0))
    assert found.resolution == pytest.approx(0.01)
    assert abs(found.time - 7.5) <= 0.01


def test_ringing_and_a_bump_before_do_not_move_the_release() -> None:
    t, force = pull(7.5, 0.0, 0.03, 3)
    force[:, 1] += 1.5 * np.exp(-(((t - 4.0) / 0.05) ** 2))
    late = np.maximum(t - 7.5, 0)
    force += (np.exp(-late / 0.01) * np.sin(900 * late))[:, None]
    assert abs(find_release(t, force).time - 7.5) <= 1e-3


def test_a_gap_at_the_release_is_refused_and_one_elsewhere_is_not() -> None:
    t, force = pull(7.5, 0.0, 0.03, 3)
    there = (t < 7.48) | (t > 7.51)
    with pytest.raises(UserError, match="missing for 3[0-9] ms around the release"):
        find_release(t[there], force[there])
    elsewhere = (t < 6.0) | (t > 6.5)
    assert abs(find_release(t[elsewhere], force[elsewhere]).time - 7.5) <= 1e-3


def test_no_release() -> None:
    t, force = pull(20.0, 0.0, 0.03, 1)
    with pytest.raises(UserError, match="no release"):
        find_release(t, force)


def gripper(closes: float, opens: float):
    t = np.arange(0, 9, 0.02)
    return t, np.where((t >= closes) & (t < opens), 0.016, 0.08)


def test_grasp_is_when_the_fingers_have_closed() -> None:
    height = np.zeros(450)
    assert find_grasp(gripper(1.0, 7.53), (gripper(1, 2)[0], height), 7.5) == pytest.approx(1.0)


def test_an_earlier_try_to_grasp_does_not_count() -> None:
    t, opening = gripper(1.5, 7.53)
    opening[(t > 0.5) & (t < 0.8)] = 0.016
    assert find_grasp((t, opening), (t, 0 * t), 7.5) == pytest.approx(1.5, abs=0.021)


def test_without_a_gripper_the_lift_tells() -> None:
    t = np.arange(0, 9, 0.01)
    height = 0.2 * np.clip(t - 1.0, 0, 1)
    assert find_grasp(None, (t, height), 7.5) == pytest.approx(1.03, abs=0.02)
    with pytest.raises(UserError, match="no grasp"):
        find_grasp(None, (t, 0 * t), 7.5)


def test_a_band_that_slips_out_is_noticed() -> None:
    t, opening = gripper(1.0, 99.0)
    with pytest.raises(UserError, match="stays closed"):
        find_grasp((t, opening), (t, 0 * t), 7.5)
