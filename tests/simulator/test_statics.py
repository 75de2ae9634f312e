"""The simulator at rest against closed forms and against its own energy in NumPy."""

import numpy as np
import pytest

from sling2sim2real.simulator import launch
from sling2sim2real.simulator.initial import hanging_guess
from sling2sim2real.simulator.model import GRAVITY
from tests.simulator.bands import at_rest, neo
from validation.simulator.reference import ReferenceRod

THETA = [5e5, 0.45, 2e-3, 0.5, 1.0]


def test_hanging_band_is_an_equilibrium_of_the_energy(sling):
    sections, rod = (
        at_rest(sling, neo(THETA), hanging_guess(sling)),
        ReferenceRod(sling, neo(THETA)),
    )
    slope = rod.gradient(sections)
    slope[:, 2] += rod.gravity * rod.mass[:, 2]
    weight = sling.mass / sling.edges * GRAVITY
    assert np.abs(slope[1:-1, :3]).max() < 0.05 * weight
    assert np.abs(slope[:-1, 3:]).max() < 0.05 * weight * sling.rest_length / sling.edges
    assert sections[sling.middle, 2] < -0.15


def test_single_and_double_precision_hold_the_same_force(sling, launch_setup):
    thetas = np.array([THETA, [1e7, 0.49, 1e-3, 0.5, 0.5]])
    single, double = (
        launch(sling, launch_setup, neo(thetas), [-0.4, -0.2], double=d) for d in (False, True)
    )
    assert single.hold_force == pytest.approx(double.hold_force, rel=1e-4)
