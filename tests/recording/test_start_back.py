"""A hand that starts back when the band lets it go tells by how much the pose is late."""

from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.recording.start_back import start_back

RELEASE = 3.0
TIME = np.arange(0.0, 4.0, 0.002)


def pull(away: np.ndarray) -> SimpleNamespace:
    """A hand 0.4 m behind the fork that is `away` (S,) from there at TIME [m]."""
    path = np.stack([0 * away, -0.4 - away, 0 * away], axis=1)
    motion = SimpleNamespace(
        time=TIME, path=path, period=0.002, position=lambda time: np.array([0.0, -0.4, 0.0])
    )
    release = SimpleNamespace(time=RELEASE, fall=0.0007, resolution=0.001)
    return SimpleNamespace(release=release, motion=motion)


def swing(begin: float) -> np.ndarray:
    """A 5 kg arm on 12 kN/m, which 15 N let go; half its critical damping [m]."""
    since, rate = np.clip(TIME - begin, 0, None), np.sqrt(12000 / 5)
    turn = rate * np.sqrt(0.75)
    rest = np.cos(turn * since) + 0.5 / np.sqrt(0.75) * np.sin(turn * since)
    return 15 / 12000 * (1 - np.exp(-0.5 * rate * since) * rest)


def retreat(begin: float) -> np.ndarray:
    return 0.13 * np.clip(TIME - begin, 0, None)


@pytest.mark.parametrize("moves", [swing, retreat])
@pytest.mark.parametrize("late", [-0.03, -0.005, 0.0, 0.012, 0.03])
def test_the_poses_delay_is_found_with_a_true_error(moves, late) -> None:
    off, errors = [], []
    for seed in range(8):
        shaken = np.random.default_rng(seed).normal(0, 4e-6, len(TIME))
        value, error = start_back(pull(moves(RELEASE + late) + shaken))
        off.append(value - late)
        errors.append(error)
    assert np.abs(off).max() < 0.002
    assert np.sqrt(np.mean((np.array(off) / errors) ** 2)) < 1.5


def test_a_hand_that_rests_or_wanders_says_nothing() -> None:
    random = np.random.default_rng(1)
    assert start_back(pull(random.normal(0, 2e-5, len(TIME)))) is None
    assert start_back(pull(1e-4 * np.sin(2 * TIME))) is None
    assert start_back(pull(retreat(RELEASE + 0.5))) is None
    assert start_back(pull(-retreat(RELEASE))) is None  # towards the fork
