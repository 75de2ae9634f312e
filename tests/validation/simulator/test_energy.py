"""The hand's work is accounted for within 1 %, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from validation.simulator import energy

from .kept import assert_kept


@pytest.fixture(scope="module")
def done(bench):
    return energy.balance(bench)


def test_work_of_the_hand_is_accounted_for(done):
    assert_kept(energy.checks(done))


def test_losses_only_grow(done):
    """Damping and pads never give back: power of 1e-9 of the hand's work a step at most."""
    total = done.hand[-1]
    assert np.diff(done.viscous).min() > -1e-6 * total
    assert np.diff(done.pads).min() > -1e-9 * total
    assert done.viscous[-1] > 0.8 * total  # at rest again, nothing else is left
