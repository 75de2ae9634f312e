"""The simulator at rest against closed forms and against its own energy in NumPy."""

import numpy as np
import pytest

from sling2sim2real.simulator import launch
from tests.simulator.bands import neo

THETA = [5e5, 0.45, 2e-3, 0.5, 1.0]


def test_single_and_double_precision_hold_the_same_force(sling, launch_setup):
    thetas = np.array([THETA, [1e7, 0.49, 1e-3, 0.5, 0.5]])
    single, double = (
        launch(sling, launch_setup, neo(thetas), [-0.4, -0.2], double=d) for d in (False, True)
    )
    assert single.hold_force == pytest.approx(double.hold_force, rel=1e-4)
