"""The simulator at rest against closed forms and against its own energy in NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.sling import launch
from pipeline.sling.initial import hanging_guess, sections_of
from pipeline.sling.material import material
from pipeline.sling.model import GRAVITY
from pipeline.sling.solver import FREE, LANE_STATE, Schedule, relaxation, run
from validation.simulator.reference import ReferenceRod

THETA = [5e5, 0.45, 2e-3, 0.5, 1.0]


def relaxed(sling, theta, start, double=True):
    """Sections (L, 9) at rest under gravity, from `start`."""
    table = relaxation(FREE)
    result = run(
        sling,
        Schedule(table, first_free=0),
        material(sling, np.array([theta])),
        start,
        np.zeros((1, LANE_STATE)),
        double=double,
    )
    assert result.lane_state[0, 4] == 0
    return result.state[0]


@pytest.mark.parametrize("young", [3e4, 5e5, 1e7])
@pytest.mark.parametrize("poisson", [0.30, 0.45, 0.49])
def test_pull_force_is_that_of_a_neo_hookean_string(sling, young, poisson):
    """Within 0.5 % of 2 A mu (l - J/l^2) cos, J = 1 + mu/lam (1 - 1/l), where bending is small."""
    light = replace(sling, mass=1e-4, projectile_mass=1e-6)
    theta = [young, poisson, 2e-3, 0.5, 1.0]
    mu, lam = material(sling, np.array([theta]))[0, :2]
    for depth in (0.40, 0.55):
        half = np.hypot(depth, sling.half_width)
        stretch = 2 * half / sling.rest_length
        volume = 1 + mu / lam * (1 - 1 / stretch)
        expected = 2 * sling.area * mu * (stretch - volume / stretch**2) * depth / half
        force = launch(light, theta, [-depth, 0.0]).hold_force[0]
        assert force == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("poisson", [0.30, 0.45, 0.49])
def test_clamped_beam_sags_as_euler_bernoulli_says(sling, poisson):
    """q L^4 / (384 E I) at the middle of a straight clamped band, within 3 %."""
    beam = replace(
        sling, half_width=sling.rest_length / 2, clamp_direction=np.array([1.0, 0.0, 0.0])
    )
    young = 1e7
    nodes = np.zeros((beam.sections, 3))
    nodes[:, 0] = beam.arc - beam.half_width
    load = beam.mass / 20 * GRAVITY / beam.rest_length  # light: the sag stays small
    beam = replace(beam, mass=beam.mass / 20)
    inertia = np.pi * beam.radius**4 / 4
    expected = load * beam.rest_length**4 / (384 * young * inertia)
    sections = relaxed(beam, [young, poisson, 2e-3, 0.5, 1.0], sections_of(beam, nodes))
    assert -sections[beam.middle, 2] == pytest.approx(expected, rel=0.03)


def test_hanging_band_is_an_equilibrium_of_the_energy(sling):
    sections = relaxed(sling, THETA, hanging_guess(sling))
    rod = ReferenceRod(sling, tuple(THETA))
    slope = rod.gradient(sections)
    slope[:, 2] += rod.gravity * rod.mass[:, 2]
    weight = sling.mass / sling.edges * GRAVITY
    assert np.abs(slope[1:-1, :3]).max() < 0.05 * weight
    assert np.abs(slope[:-1, 3:]).max() < 0.05 * weight * sling.rest_length / sling.edges
    assert sections[sling.middle, 2] < -0.15


def test_single_and_double_precision_hold_the_same_force(sling):
    draw = [-0.4, -0.2]
    for theta in (THETA, [1e7, 0.49, 1e-3, 0.5, 0.5]):
        single = launch(sling, theta, draw).hold_force[0]
        double = launch(sling, theta, draw, double=True).hold_force[0]
        assert single == pytest.approx(double, rel=1e-4)
