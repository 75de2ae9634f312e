"""Grasp and release of made-up signals, whose times are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.events import find_grasp, find_release, find_releases
from sling2sim2real.recording.motion import Motion

DIRECTION = np.array([0.3, -0.8, 0.52])


def pull(
    release: float, fall: float, noise: float, seed: int, rate: float = 1000.0, start: float = 0.0
):
    """Lead-in, pull to 12 N, hold, and a fall that takes `fall` seconds."""
    t = np.arange(start, 9, 1 / rate)
    held = 12 * np.clip((t - 2) / 3, 0, 1)
    left = np.clip(1 - (t - release) / fall, 0, 1) if fall else (t < release)
    force = (held * left)[:, None] * DIRECTION / np.linalg.norm(DIRECTION) + [3.0, -2.0, 7.0]
    return t, force + np.random.default_rng(seed).normal(0, noise, force.shape)


@pytest.mark.parametrize("rate", [200.0, 500.0, 1000.0, 2000.0])
@pytest.mark.parametrize("noise", [0.02, 0.2])
def test_release_between_samples_is_unbiased_and_its_error_is_true(rate, noise) -> None:
    """Random phases between samples, falls of 0 to 6 ms, dropped samples."""
    random = np.random.default_rng(5)
    off, error, resolution = [], [], []
    for seed in range(40):
        release = 7.5 + random.uniform(0, 7 / rate)
        fall = random.choice([0.0, random.uniform(0, 6e-3)])
        t, force = pull(release, fall, noise, seed, rate, start=5.0)
        retained = random.random(len(t)) >= 0.02
        event = find_release(t[retained], force[retained])
        off.append(event.time - release)
        error.append(event.error)
        resolution.append(event.resolution)
    off, error = np.array(off), np.array(error)
    period = max(1 / rate, 5e-4)
    assert np.percentile(np.abs(off), 95) <= 0.7 * period
    assert abs(off.mean()) <= 0.2 * period
    assert 0.6 < np.sqrt(np.mean((off / np.maximum(error, 2e-5)) ** 2)) < 1.7
    assert np.all(error <= np.array(resolution))


def test_a_fall_within_one_sample_is_put_between_the_two() -> None:
    """The last held and the first fallen sample bound it; neither is more likely."""
    t, force = pull(7.5003, 0.0, 0.02, 1)
    event = find_release(t, force)
    assert 7.5002 < event.time < 7.5007
    assert event.error == pytest.approx(1e-3 / np.sqrt(12), rel=0.15)


@pytest.mark.parametrize("noise", [0.005, 0.15])
def test_release_is_found_to_a_millisecond(noise) -> None:
    for seed in range(12):
        release, fall = 7.5 + 0.00037 * seed, (0.0, 0.002, 0.005, 0.02)[seed % 4]
        event = find_release(*pull(release, fall, noise, seed))
        assert abs(event.time - release) <= 1e-3
        assert event.drop == pytest.approx(12, rel=0.02)
        assert event.noise == pytest.approx(noise, rel=0.3)


def test_release_at_a_low_rate_says_so() -> None:
    event = find_release(*pull(7.5, 0.0, 0.02, 1, rate=100.0))
    assert event.resolution == pytest.approx(0.01)
    assert abs(event.time - 7.5) <= 0.01


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


def test_a_slip_before_is_no_release_but_is_reported() -> None:
    """The band slides through the fingers, which costs more than what is left to let go."""
    t, force = pull(7.5, 0.0, 0.03, 3)
    bias = np.array([3.0, -2.0, 7.0])
    force[t >= 5.5] = bias + 0.4 * (force[t >= 5.5] - bias)
    event = find_release(t, force)
    assert abs(event.time - 7.5) <= 1e-3
    assert event.drop == pytest.approx(0.4 * 12, rel=0.02)
    np.testing.assert_allclose(event.slips, [5.5], atol=0.01)


def test_a_knock_in_the_lead_in_is_no_release() -> None:
    t, force = pull(7.5, 0.0, 0.03, 3)
    force[(t > 0.6) & (t < 0.62)] += [0.0, 40.0, 0.0]
    event = find_release(t, force)
    assert abs(event.time - 7.5) <= 1e-3 and event.slips == []


def test_two_pulls_are_refused_unless_the_fingers_tell() -> None:
    t, force = pull(4.0, 0.0, 0.03, 3)
    again = pull(7.5, 0.0, 0.03, 4)[1]
    force[t > 5.5] = again[t > 5.5]  # caught again at 12 N
    with pytest.raises(UserError, match=r"let go at 4\.0 and 7\.5 s"):
        find_release(t, force)
    assert abs(find_release(t, force, gripper(1.0, 7.53)).time - 7.5) <= 1e-3


def moving(t: np.ndarray, path: np.ndarray) -> Motion:
    return Motion(t, path, Rotation.identity(len(t)), float(np.median(np.diff(t))))


def resting(t: np.ndarray) -> Motion:
    return moving(t, np.zeros((len(t), 3)))


def gripper(closes: float, opens: float):
    t = np.arange(0, 9, 0.02)
    return t, np.where((t >= closes) & (t < opens), 0.016, 0.08)


def test_grasp_is_when_the_fingers_have_closed_for_good() -> None:
    t, opening = gripper(1.0, 7.53)
    assert find_grasp((t, opening), resting(t), 7.5) == pytest.approx(1.0)
    t, opening = gripper(1.5, 7.53)
    opening[(t > 0.5) & (t < 0.8)] = 0.016
    assert find_grasp((t, opening), resting(t), 7.5) == pytest.approx(1.5, abs=0.021)


def lifted(t: np.ndarray, at: float) -> np.ndarray:
    """Down to the band from 10 cm above, and from `at` on up at 0.2 m/s for a second."""
    down = 0.1 * np.clip(0.5 - t, 0, 0.5)
    return np.stack([0 * t, 0 * t, down + 0.2 * np.clip(t - at, 0, 1)], axis=1)


def test_without_a_gripper_the_lift_tells() -> None:
    t = np.arange(0, 9, 0.01)
    assert find_grasp(None, moving(t, lifted(t, 1.0)), 7.5) == pytest.approx(1.03, abs=0.02)
    with pytest.raises(UserError, match="no grasp"):
        find_grasp(None, resting(t), 7.5)


def test_a_gripper_topic_that_comes_late_does_not_move_the_grasp_into_the_lift() -> None:
    t = np.arange(0, 9, 0.01)
    late = gripper(1.3, 7.83)  # by 0.3 s, while the hand lifts from 1.02 s on
    assert find_grasp(late, moving(t, lifted(t, 1.02)), 7.5) == pytest.approx(1.02, abs=0.03)


def test_a_gripper_topic_that_starts_after_the_grasp_leaves_it_to_the_lift() -> None:
    t, opening = gripper(0.0, 7.53)
    seen = t > 3
    hand = moving(t, lifted(t, 1.0))
    assert find_grasp((t[seen], opening[seen]), hand, 7.5) == pytest.approx(1.03, abs=0.03)


def test_a_band_that_slips_out_is_noticed() -> None:
    t, opening = gripper(1.0, 99.0)
    with pytest.raises(UserError, match="stays closed"):
        find_grasp((t, opening), resting(t), 7.5)


UNITS = {"m": 0.08, "mm": 80.0, "percent": 100.0, "knuckle": -0.8, "steps": -255.0}


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("lead", [0.0, 0.7])  # closed at first, then opened around the band
def test_grasp_by_a_gripper_of_any_sign_and_unit(unit, lead) -> None:
    t, force = pull(7.5, 0.002, 0.02, 3)
    times = np.arange(0, 9, 0.02)
    open_ = np.interp(times, [lead, lead + 0.1, 1.2, 1.4, 7.5, 7.7], [lead == 0, 1, 1, 0.1, 0.1, 1])
    noise = np.random.default_rng(4).normal(0, 1e-3, len(times))
    gripper = times, UNITS[unit] * (open_ + noise) + (0.8 if UNITS[unit] < 0 else 0)
    release = find_release(t, force, gripper).time
    assert find_grasp(gripper, resting(t), release) == pytest.approx(1.38, abs=0.05)
    assert find_releases(t, force, gripper) == pytest.approx([7.5], abs=0.01)
    slipped = times, np.where(times > 7, gripper[1][340] - 0.05 * UNITS[unit], gripper[1])
    with pytest.raises(UserError, match="the gripper stays closed"):
        find_grasp(slipped, resting(t), release)
