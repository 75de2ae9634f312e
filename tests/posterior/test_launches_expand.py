"""Launches that are evidence: their quadratic against a landing in closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.posterior import launches as module
from pipeline.posterior.launches import TAPE, Launches, Observed

POWER = np.array([0.5, -0.3, 1.0])
STEPS = np.array([1e-5, 1e-5, 1e-5])
PHI = np.array([0.2, 0.4, -0.1])


def landing(points: np.ndarray, draws: np.ndarray) -> np.ndarray:
    """3 exp(power . phi) (-10 y) (1 + z), of (N, 3) and (N, 2)."""
    return -30 * np.exp(points @ POWER) * draws[:, 0] * (1 + draws[:, 1])


@pytest.fixture(autouse=True)
def closed_form(monkeypatch):
    """A draw shorter than 0.1 m fails."""

    def launch(sling, points, draws, workers):
        failure = ["short" if draw[0] > -0.1 else None for draw in draws]
        return SimpleNamespace(landing_y=landing(points, draws), failure=failure)

    monkeypatch.setattr(module, "launch", launch)
    monkeypatch.setattr(module, "at_points", lambda sling, points: (sling, points))


def expanded(*observed: Observed):
    one = Launches(observed, None)
    return one, one.expand(lambda phi: phi, PHI, STEPS)


def test_the_quadratic_is_that_of_the_closed_form():
    draws = np.array([[-0.3, -0.1], [-0.2, -0.2]])
    simulated, measured = landing(PHI[None], draws), np.array([10.0, 4.0])
    errors = np.array([0.002, 0.004])
    seen = [Observed(tuple(d), e, y) for d, e, y in zip(draws, errors, measured, strict=True)]
    one, (misfit, hessian, gradient) = expanded(*seen)
    slope = np.hypot(simulated / draws[:, 0], simulated / (1 + draws[:, 1]))
    sigma = np.hypot(slope * errors / simulated, TAPE / measured)
    gap = np.log(measured / simulated)
    np.testing.assert_allclose(one.left, gap)
    assert misfit == pytest.approx(np.sum((gap / sigma) ** 2), rel=1e-5)
    np.testing.assert_allclose(hessian, np.sum(sigma**-2) * np.outer(POWER, POWER), rtol=1e-4)
    np.testing.assert_allclose(gradient, np.sum(gap / sigma**2) * POWER, rtol=1e-4)


def test_alike_launches_add_precision_as_their_number():
    shot = Observed((-0.3, -0.1), 0.003, 9.0)
    _, once = expanded(shot)
    _, often = expanded(*[shot] * 5)
    for one, five in zip(once, often, strict=True):
        np.testing.assert_allclose(five, 5 * np.asarray(one), rtol=1e-9)


def test_a_launch_that_fails_counts_nothing():
    shot = Observed((-0.3, -0.1), 0.003, 9.0)
    one, failing = expanded(shot, Observed((-0.05, -0.1), 0.003, 9.0))
    _, alone = expanded(shot)
    for both, single in zip(failing, alone, strict=True):
        np.testing.assert_allclose(both, single)
    assert np.isnan(one.left[1]) and np.isfinite(one.left[0])


def test_the_draws_error_and_the_tape_measures_count(monkeypatch):
    _, exact = expanded(Observed((-0.3, -0.1), 0.0, 9.0))
    _, rough = expanded(Observed((-0.3, -0.1), 0.01, 9.0))
    assert exact[0] == pytest.approx((np.log(9 / landing(PHI[None], np.array([[-0.3, -0.1]])))[0]
                                      * 9 / TAPE) ** 2)  # fmt: skip
    assert rough[0] < 0.1 * exact[0]
