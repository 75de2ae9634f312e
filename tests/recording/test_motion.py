"""Derivatives of the hand's path against formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.base.errors import UserError
from sling2sim2real.recording.motion import Motion

CENTER = np.zeros(3)
RELEASE, SWAY, KICK = 1.5037, 2 * np.pi * 8, 2.4  # s, rad/s and m/s^2 of an arm that is let go


def motion(t: np.ndarray, path: np.ndarray) -> Motion:
    return Motion(t, path, Rotation.identity(len(t)), float(np.median(np.diff(t))))


def swinging(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Path and acceleration (T, 3) of a hand that rests until it starts back and swings."""
    late = np.clip(t - RELEASE, 0, None)
    along = KICK / SWAY**2 * (1 - np.cos(SWAY * late))
    bent = np.where(t > RELEASE, KICK * np.cos(SWAY * late), 0.0)
    axis = np.array([0.0, 1.0, 0.1])
    return along[:, None] * axis, bent[:, None] * axis


@pytest.mark.parametrize(
    ("rate", "noise", "most"), [(1000, 2e-5, 0.5), (100, 2e-5, 0.7), (100, 1e-4, 1.1)]
)
def test_a_hand_that_starts_back(rate, noise, most) -> None:
    """Root mean square error [m/s^2] around the release: a share of the kick."""
    t = np.arange(0, 3, 1 / rate)
    path, _ = swinging(t)
    times = np.arange(RELEASE - 0.05, RELEASE + 0.05, 0.001)
    wanted, off = swinging(times)[1], []
    for seed in range(20):
        shaken = path + np.random.default_rng(seed).normal(0, noise, path.shape)
        off.append(motion(t, shaken).acceleration(times, CENTER, RELEASE) - wanted)
    assert np.sqrt(np.mean(np.sum(np.square(off), axis=-1))) < most


def test_lost_and_irregular_samples_bend_nothing() -> None:
    """Of a polynomial of the fifth degree nothing is lost, whenever it was sampled."""
    random = np.random.default_rng(1)
    t = np.sort(random.uniform(0, 3, 90))
    bends = random.normal(size=(3, 6))
    path = np.stack([np.polyval(axis, t) for axis in bends], axis=1)
    times = np.linspace(0.2, 2.8, 50)
    wanted = np.stack([np.polyval(np.polyder(axis, 2), times) for axis in bends], axis=1)
    acceleration = motion(t, path).acceleration(times, CENTER)
    np.testing.assert_allclose(acceleration, wanted, rtol=1e-5, atol=1e-3)


def test_a_hand_that_is_not_seen_rests() -> None:
    t = np.arange(0, 1, 0.01)
    hand = motion(t, 0.5 * 3.0 * t[:, None] ** 2 * [1.0, 0, 0])
    acceleration = hand.acceleration(np.array([-0.5, 0.5, 2.0]), CENTER)
    np.testing.assert_allclose(acceleration[:, 0], [0, 3, 0], atol=1e-6)


def test_too_few_samples_are_refused() -> None:
    t = np.arange(0, 0.1, 0.01)
    with pytest.raises(UserError, match="too short"):
        motion(t, np.zeros((len(t), 3))).acceleration(t, CENTER)
