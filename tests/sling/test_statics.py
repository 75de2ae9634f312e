"""The simulator at rest against closed forms and against its own energy in NumPy."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from pipeline.sling import launch
from pipeline.sling.hang import hang
from pipeline.sling.initial import hanging_guess
from pipeline.sling.model import GRAVITY
from tests.sling.bands import at_rest
from validation.simulator.closed import String
from validation.simulator.reference import ReferenceRod

THETA = [5e5, 0.45, 2e-3, 0.5, 1.0]
HUNG = np.array([[2e5, 0.47, 2e-3, 0.5, 0.5], [6e5, 0.35, 2e-3, 0.5, 0.5]])
LOAD = 1.5


def test_hanging_band_is_an_equilibrium_of_the_energy(sling):
    sections, rod = at_rest(sling, THETA, hanging_guess(sling)), ReferenceRod(sling, tuple(THETA))
    slope = rod.gradient(sections)
    slope[:, 2] += rod.gravity * rod.mass[:, 2]
    weight = sling.mass / sling.edges * GRAVITY
    assert np.abs(slope[1:-1, :3]).max() < 0.05 * weight
    assert np.abs(slope[:-1, 3:]).max() < 0.05 * weight * sling.rest_length / sling.edges
    assert sections[sling.middle, 2] < -0.15


def test_single_and_double_precision_hold_the_same_force(sling):
    thetas = np.array([THETA, [1e7, 0.49, 1e-3, 0.5, 0.5]])
    single, double = (launch(sling, thetas, [-0.4, -0.2], double=d) for d in (False, True))
    assert single.hold_force == pytest.approx(double.hold_force, rel=1e-4)


def depth_of_strings(sling, theta, load: float) -> float:
    """Where the pull of two straight weightless strings carries the load [m]."""
    string, half = String.of(sling, theta), sling.rest_length / 2

    def pull(depth: float) -> float:
        length = np.hypot(depth, sling.half_width)
        return 2 * float(string.force(length / half)) * depth / length - load * GRAVITY

    return brentq(pull, np.sqrt(half**2 - sling.half_width**2), 5.0)


def test_a_weight_hangs_as_deep_as_two_strings_let_it(sling):
    light = replace(sling, mass=1e-4)
    nodes = hang(light, HUNG, LOAD)
    expected = [depth_of_strings(light, theta, LOAD) for theta in HUNG]
    assert abs(expected[0] - expected[1]) > 0.1
    np.testing.assert_allclose(-nodes[:, sling.middle, 2], expected, rtol=0.005)
    np.testing.assert_allclose(nodes[:, [0, -1]], np.broadcast_to(sling.tips, (2, 2, 3)), atol=1e-6)
    np.testing.assert_allclose(nodes[:, sling.middle, :2], 0, atol=1e-3)


def test_a_heavier_weight_hangs_deeper_and_so_does_a_heavier_band(sling):
    middle = sling.middle
    deeper = [-hang(sling, HUNG[0], load)[0, middle, 2] for load in (0.5, 1.0, 1.5)]
    assert np.all(np.diff(deeper) > 0.02)
    light = -hang(replace(sling, mass=sling.mass / 10), HUNG[0], LOAD)[0, middle, 2]
    assert light < deeper[-1] < 1.02 * light
