"""The evidence of launches in a toy whose landings are a closed form."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.identify.posterior import launches
from pipeline.identify.posterior.launches import TAPE, LaunchLikelihood, Observed

STEPS = np.array([1e-3, 1e-3])


def toy(sling, setup, theta: np.ndarray, draws: np.ndarray, workers: int) -> SimpleNamespace:
    """log landing is linear in both coordinates; none from draws above z = 0."""
    y, z = np.asarray(draws).T
    landing = np.exp(theta @ [1.0, 0.5]) * y**2 * (1 - z)
    failure = [None if one <= 0 else "no" for one in z]
    return SimpleNamespace(landing_y=landing, failure=failure)


@pytest.fixture(autouse=True)
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(launches, "launch", toy)


def expanded(*observed: Observed, phi=(0.0, 0.0)):
    evidence = LaunchLikelihood(observed, None, None)
    return evidence, *evidence.expand(lambda phi: phi, np.array(phi), STEPS)


def test_the_update_is_the_linear_gaussian_one() -> None:
    """Landing y^2 (1 - z) e^(a + b/2): d log = 2/y, -1/(1 - z) by the draw, 1 and 1/2 by a, b."""
    y, z, error, landing = -0.5, -0.2, 0.004, 0.33
    evidence, misfit, hessian, gradient = expanded(Observed((y, z), error, landing))
    here = y**2 * (1 - z)
    spread = np.hypot(error * np.hypot(2 / y, 1 / (1 - z)), TAPE / landing)
    gap, design = np.log(landing / here) / spread, np.array([1.0, 0.5]) / spread
    assert evidence.left == pytest.approx([np.log(landing / here)])
    assert misfit == pytest.approx(gap**2, rel=1e-3)
    np.testing.assert_allclose(hessian, np.outer(design, design), rtol=1e-3)
    np.testing.assert_allclose(gradient, gap * design, rtol=1e-3)
    prior = np.diag([4.0, 25.0])
    moved = np.linalg.solve(prior + hessian, gradient)
    variance = np.array([1 / 4, 1 / 25])
    gain = variance * [1, 0.5] / (variance @ [1, 0.25] + spread**2)  # Kalman's
    np.testing.assert_allclose(moved, gain * np.log(landing / here), rtol=1e-3)


def test_two_launches_tell_more_than_one_and_their_order_nothing() -> None:
    one, two = Observed((-0.5, -0.2), 0.001, 0.31), Observed((-0.6, -0.1), 0.0, 0.4)
    first, second = expanded(one), expanded(two)
    for both in (expanded(one, two), expanded(two, one)):
        for index in (1, 2, 3):
            np.testing.assert_allclose(both[index], first[index] + second[index], rtol=1e-6)
    assert np.trace(expanded(one, two)[2]) > max(np.trace(first[2]), np.trace(second[2]))


def test_a_launch_that_fails_in_simulation_counts_for_nothing() -> None:
    good, bad = Observed((-0.5, -0.2), 0.001, 0.31), Observed((-0.5, 0.2), 0.001, 0.31)
    alone, both = expanded(good), expanded(good, bad)
    assert np.isnan(both[0].left[1])
    for index in (1, 2, 3):
        np.testing.assert_allclose(both[index], alone[index])


def test_at_the_truth_nothing_pulls() -> None:
    phi = (0.2, -0.1)
    landing = float(toy(None, None, np.array([phi]), np.array([[-0.5, -0.2]]), 1).landing_y[0])
    _, misfit, _, gradient = expanded(Observed((-0.5, -0.2), 0.001, landing), phi=phi)
    assert misfit == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(gradient, 0, atol=1e-6)
