"""Zeros of a force that is made: what was put in comes out, what rubber does is left."""

import numpy as np
import pytest
from sling2sim2real.recording.zero import drift_of, zeroed

T = np.arange(10_000) / 1000
BIAS = np.array([3.0, -4.0, 6.0])
WAY = np.array([0.1, 0.97, -0.2])


def made(noise: float = 0.05, seed: int = 0) -> np.ndarray:
    """Grasped at 1 s, drawn from 4 to 6 s to 14 N, let go at 8 s."""
    random = np.random.default_rng(seed)
    pull = 14 * np.clip((T - 4) / 2, 0, 1) ** 0.8 * (T < 8)
    return BIAS + pull[:, None] * WAY + random.normal(0, noise, (len(T), 3))


@pytest.mark.parametrize("at", [0.3, 0.8, 3.0, 5.0, 7.0, 9.0])
@pytest.mark.parametrize("size", [0.8, 7.0])
def test_a_sensor_that_is_zeroed(at, size) -> None:
    """While free, slack or drawn: the force is whole again, with the zero of the end."""
    step = size * np.array([0.6, -0.64, 0.48])
    force = made()
    result, steps = zeroed(T, force + (T > at)[:, None] * step)
    assert [jump.time for jump in steps] == [pytest.approx(at, abs=0.002)]
    np.testing.assert_allclose(steps[0].size, step, atol=0.1)
    np.testing.assert_allclose(result.mean(axis=0), (force + step).mean(axis=0), atol=0.1)


def test_a_band_that_slips_and_a_hand_that_jerks_are_left() -> None:
    for seed in range(5):
        force = made(seed=seed)
        slips = force - 5.0 * ((T > 6.5) & (T < 8))[:, None] * WAY
        jerks = force + 1.0 * ((T > 0.2) & (T < 0.4))[:, None] * WAY
        for case in (force, slips, jerks):
            assert zeroed(T, case) == (case, [])


@pytest.mark.parametrize("mass", [0.3, 1.0, 2.0])
def test_a_hand_that_stops_is_no_new_zero(mass) -> None:
    """A dip's last way, 10 cm in a second, ends at 7 s; the zero drifts by as much as it jerks."""
    part = np.clip(T - 6, 0, 1)
    way = 0.1 * part**2 * (3 - 2 * part)
    path = way[:, None] * WAY + 1e-4 * np.sin(9 * T)[:, None]
    speeds_up = 0.6 * (1 - 2 * part) * ((T > 6) & (T < 7))
    step = -mass * 0.6 * WAY
    force = made() - mass * speeds_up[:, None] * WAY + (T / 10)[:, None] * step

    def hand(times: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(times, T, axis) for axis in path.T], axis=1)

    assert zeroed(T, force, hand)[1] == []
    assert bool(zeroed(T, force)[1]) == (mass > 0.5)  # as it looks without the path
    at_rest = force + (T > 7.6)[:, None] * (4 * step)
    assert [jump.time for jump in zeroed(T, at_rest, hand)[1]] == [pytest.approx(7.6, abs=0.002)]


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
