"""Recordings that share what their law gets wrong: together they tell no less than the best one."""

from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.identification.posterior.expansion import Expansion, Form
from sling2sim2real.identification.posterior.sharing import shares

RNG = np.random.default_rng(3)
SIZE, COORDINATES = 30, 2
PRIOR = np.array([0.3, 0.0])


def recording(slopes: np.ndarray, nuisances: np.ndarray) -> Expansion:
    """Of slopes (2, 30), linear nuisances (M, 30), and three simulated ones that change nothing."""
    residuals = SimpleNamespace(size=SIZE)
    form = Form.of(residuals, np.full(SIZE, 2.0), nuisances)
    none = np.zeros((3, SIZE))
    parts = np.zeros(SIZE), slopes, none, np.zeros(SIZE), np.zeros(3), np.ones(3)
    return Expansion.of(form, *parts, origin=0.0)


def exact(slopes: np.ndarray, nuisances: np.ndarray, times: float) -> np.ndarray:
    """Information (2, 2) where the residuals' covariance is written out, nuisances and noise."""
    covariance = np.eye(SIZE) / (4 * times) + nuisances.T @ nuisances
    return slopes @ np.linalg.solve(covariance, slopes.T)


@pytest.mark.parametrize("times", [1.0, 0.25])
def test_what_a_recording_tells_by_its_share(times) -> None:
    slopes, nuisances = RNG.normal(size=(2, SIZE)), RNG.normal(size=(4, SIZE))
    told = recording(slopes, nuisances)
    np.testing.assert_allclose(told.told(times), exact(slopes, nuisances, times), rtol=1e-9)
    np.testing.assert_allclose(told.told(1.0), told.hessian, rtol=1e-9)


def determinant(information: np.ndarray) -> float:
    return float(np.linalg.det(information + np.diag(PRIOR)))


def together(recordings: list[Expansion]) -> tuple[np.ndarray, float]:
    found = shares(recordings, PRIOR)
    told = sum(it.told(share) for it, share in zip(recordings, found, strict=True))
    return found, determinant(told)


@pytest.mark.parametrize("seed", range(5))
def test_several_are_never_worse_than_the_best_of_them(seed) -> None:
    """Some see one coordinate only, or hardly anything."""
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.01, 2, (3, 2, 1)) * (rng.random((3, 2, 1)) > 0.3)
    recordings = [
        recording(size * rng.normal(size=(2, SIZE)), rng.normal(size=(2, SIZE))) for size in sizes
    ]
    found, all_of_them = together(recordings)
    assert found.sum() == pytest.approx(1) and found.min() >= 0
    best = max(determinant(it.told(1.0)) for it in recordings)
    assert all_of_them >= 0.99 * best


def test_equal_recordings_average_their_instruments_but_not_the_law() -> None:
    """Of three: no narrower where nothing else than the law errs; and by 3 where it hardly does."""
    slopes, none = RNG.normal(size=(2, SIZE)), np.zeros((1, SIZE))
    alone = recording(slopes, none)
    found, _ = together([alone] * 3)
    np.testing.assert_allclose(found, 1 / 3, atol=1e-3)
    np.testing.assert_allclose(3 * alone.told(1 / 3), alone.hessian, rtol=1e-9)
    instruments = recording(slopes, 50 * slopes)
    ratio = 3 * instruments.told(1 / 3) @ np.linalg.inv(instruments.hessian)
    np.testing.assert_allclose(ratio, 3 * np.eye(2), atol=0.02)


def test_a_recording_that_tells_nothing_takes_no_share() -> None:
    slopes, nuisances = RNG.normal(size=(2, SIZE)), RNG.normal(size=(2, SIZE))
    blind = recording(0 * slopes, nuisances)
    found, _ = together([recording(slopes, nuisances), blind])
    assert found[0] > 0.99
