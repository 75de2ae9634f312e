"""Zeros of a force that is made: what was put in comes out, what rubber does is left."""

import numpy as np
import pytest

from sling2sim2real.recording.force import drift_of

T = np.arange(10_000) / 1000
BIAS = np.array([3.0, -4.0, 6.0])
WAY = np.array([0.1, 0.97, -0.2])


def made(noise: float = 0.05, seed: int = 0) -> np.ndarray:
    """Grasped at 1 s, drawn from 4 to 6 s to 14 N, let go at 8 s."""
    random = np.random.default_rng(seed)
    pull = 14 * np.clip((T - 4) / 2, 0, 1) ** 0.8 * (T < 8)
    return BIAS + pull[:, None] * WAY + random.normal(0, noise, (len(T), 3))


def course(shape) -> tuple:
    force = made() + shape(T)[:, None] * WAY
    return drift_of(T, force, T < 0.95, T > 8.4, 14.0)


@pytest.mark.parametrize("size", [0.0, 0.3, 2.0, 5.0])
def test_a_steady_drift_is_known_of_any_size(size) -> None:
    drift = course(lambda t: size * t / 10)
    assert drift.steady
    np.testing.assert_allclose(10 * drift.rate, size * WAY, atol=0.02)


@pytest.mark.parametrize("size", [0.5, 1.0, 3.0])
def test_a_zero_that_warms_up_or_does_not_return_is_no_drift(size) -> None:
    """1 - exp(-t / 1.5 s), and a return error after the load."""
    for shape in (lambda t: size * (1 - np.exp(-t / 1.5)), lambda t: size * (t > 8)):
        drift = course(shape)
        assert not drift.steady and not drift.rate.any()
        assert np.linalg.norm(drift.change) == pytest.approx(size, rel=0.35)


def test_a_small_return_error_is_no_drift_either() -> None:
    """1.7 % of what was held, which would make a modulus 2 % too small."""
    assert not course(lambda t: 0.24 * (t > 8)).steady
    assert course(lambda t: 0.24 * t / 10).steady


def test_a_drift_that_the_free_hand_is_too_short_to_show_is_not_taken_out() -> None:
    """A quarter of a second at both ends tells neither a drift nor a zero that does not return."""
    for shape in (lambda t: 0.5 * t / 10, lambda t: 0.5 * (t > 8)):
        force = made() + shape(T)[:, None] * WAY
        drift = drift_of(T, force, (T > 0.7) & (T < 0.95), (T > 8.4) & (T < 8.65), 14.0)
        assert not drift.steady and not drift.rate.any()
