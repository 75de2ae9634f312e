"""Free fall to rounding, momentum kept."""

from __future__ import annotations

import numpy as np
import pytest

from validation.simulator import free_motion as motion

from .kept import assert_kept


def test_free_fall_is_the_steps_own_solution(bench):
    assert_kept(motion.free_fall(bench))


def test_formulas_fall_as_galileo_says():
    """First order at the first order, second order at the second."""
    for order in (1, 2):
        errors = []
        for count in (50, 100):
            times = np.linspace(0, 1, count + 1)
            errors.append(abs(motion.fall_of_a_point(times, order)[-1] + motion.GRAVITY / 2))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)


def test_linear_momentum_is_kept(bench):
    assert_kept(motion.momentum(bench))


def test_angular_momentum_is_kept_the_better_the_finer_the_steps(bench):
    coarse, fine = (motion.recoil(bench, h, 2, 0.0)[1] for h in (5e-4, 1.25e-4))
    assert fine < coarse / 12 and fine < 1e-4
