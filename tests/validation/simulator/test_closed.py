"""The closed forms that checks hold the simulator against, held against themselves."""

import numpy as np
import pytest
from scipy.optimize import brentq

from validation.simulator.closed import String
from validation.simulator.experiment import band_of
from validation.simulator.free_motion import GRAVITY, fall_of_a_point


def test_closed_form_has_no_stress_across(bench):
    """J by a root of the law itself, and P as the slope of its energy."""
    string = String.of(band_of(bench), [1e6, 0.40, 2e-3, 0.5, 1.0])

    def energy(stretch: float, q: float) -> float:
        j = stretch * q**2
        shape = string.mu / 2 * (stretch**2 + 2 * q**2 - 3) - string.mu * (j - 1)
        return shape + string.lam / 2 * (j - 1) ** 2

    def slope(function, at: float) -> float:
        return (function(at + 1e-5) - function(at - 1e-5)) / 2e-5

    for stretch in (0.9, 1.3, 2.2):
        q = brentq(lambda q, s=stretch: slope(lambda x: energy(s, x), q), 0.4, 1.5)
        assert string.volume(stretch) == pytest.approx(stretch * q**2, rel=1e-6)
        pull = string.sling.area * slope(lambda x, q=q: energy(x, q), stretch)
        assert string.force(stretch) == pytest.approx(pull, rel=1e-6)


def test_tangents_are_the_slope_of_the_pull(bench):
    string = String.of(band_of(bench), [1e6, 0.40, 2e-3, 0.5, 1.0])
    step = 1e-5
    slope = (string.force(1.5 + step) - string.force(1.5 - step)) / (2 * step)
    k, c = string.axial(1.5)
    assert k == pytest.approx(4 * slope / string.sling.rest_length, rel=1e-6)
    assert c == pytest.approx(string.damping * k, rel=1e-9)  # s = 1: d times the stiffness
    assert np.isclose(string.force(1.0), 0.0)


def test_formulas_fall_as_galileo_says():
    """First order at the first order, second order at the second."""
    for order in (1, 2):
        errors = []
        for count in (50, 100):
            times = np.linspace(0, 1, count + 1)
            errors.append(abs(fall_of_a_point(times, order)[-1] + GRAVITY / 2))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
