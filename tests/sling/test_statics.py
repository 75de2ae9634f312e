"""The simulator at rest against closed forms and against its own energy in NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.sling import launch
from pipeline.sling.initial import hanging_guess
from pipeline.sling.model import GRAVITY
from tests.sling.bands import along_x, at_rest, in_line
from validation.simulator.closed import String, clamped_beam
from validation.simulator.reference import ReferenceRod

THETA = [5e5, 0.45, 2e-3, 0.5, 1.0]


def test_pull_force_is_that_of_a_neo_hookean_string(sling):
    """Within 0.5 % of two straight strings', where bending is small."""
    light = replace(sling, mass=1e-4, projectile_mass=1e-6)
    pairs = [(young, poisson) for young in (3e4, 5e5, 1e7) for poisson in (0.30, 0.45, 0.49)]
    thetas = np.array([[*pair, 2e-3, 0.5, 1.0] for pair in pairs])
    for depth in (0.40, 0.55):
        half = np.hypot(depth, sling.half_width)
        strings = [String.of(sling, theta) for theta in thetas]
        pull = np.array([string.force(2 * half / sling.rest_length) for string in strings])
        force = launch(light, thetas, [-depth, 0.0]).hold_force
        assert force == pytest.approx(2 * pull * depth / half, rel=5e-3)


def test_clamped_beam_sags_as_euler_bernoulli_says(sling):
    """Within 3 %; light, so that the sag stays small."""
    beam, young = in_line(sling, mass=sling.mass / 20), 1e7
    load, inertia = beam.mass * GRAVITY / beam.rest_length, np.pi * beam.radius**4 / 4
    expected = clamped_beam(load, beam.rest_length, young * inertia)
    for poisson in (0.30, 0.45, 0.49):
        sections = at_rest(beam, [young, poisson, 2e-3, 0.5, 1.0], along_x(beam))
        assert -sections[beam.middle, 2] == pytest.approx(expected, rel=0.03), poisson


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
