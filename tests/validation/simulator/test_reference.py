"""The reference's forces are its energy's slope; test_limits.py holds the kernel against it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.simulator.initial import hanging_guess
from sling2sim2real.simulator.parameters import Parameters
from sling2sim2real.simulator.rubber import NEO_HOOKEAN
from validation.simulator.closed import String
from validation.simulator.experiment import band_of
from validation.simulator.reference import ReferenceRod

FIVE = (5e5, 0.42, 3e-3, 0.5, 0.6)
THETA = Parameters.of(NEO_HOOKEAN, FIVE)


def rough(sling) -> np.ndarray:
    rng = np.random.default_rng(0)
    size = np.where(np.arange(9) < 3, 2e-4, 2e-2)
    return hanging_guess(sling) + size * rng.normal(size=(sling.sections, 9))


def test_gradient_is_the_energys_slope(bench):
    for gripped, clamped in itertools.product((False, True), ((True, True), (True, False))):
        sling = replace(band_of(bench), clamped=clamped, clamp_twist=0.3)
        rod, sections = ReferenceRod(sling, THETA, gripped=gripped), rough(sling)
        steps = 1e-6 * np.eye(sections.size).reshape(-1, *sections.shape)
        slope = (rod.elastic(sections + steps) - rod.elastic(sections - steps)) / 2e-6
        moves = slice(0, -9)  # the last directors have no edge
        assert rod.gradient(sections).ravel()[moves] == pytest.approx(
            slope[moves], rel=1e-6, abs=1e-7
        )


def test_viscous_force_is_the_rate_of_the_elastic_force(bench):
    """At s = 1, turns braked and a stretched state: d times the tangent, edge by edge."""
    sling, five = band_of(bench), (5e5, 0.42, 1.0, 0.5, 1.0)
    rod = ReferenceRod(sling, Parameters.of(NEO_HOOKEAN, five, turn_damping=1.0))
    rng = np.random.default_rng(1)
    sections = np.zeros((sling.sections, 9))
    sections[:, 0] = 1.5 * sling.arc
    # in uniaxial stress, where the bound that keeps slack states dissipative does not bind
    sections[:, 4] = sections[:, 8] = np.sqrt(String.of(sling, five).volume(1.5) / 1.5)
    rate = rng.normal(size=sections.shape)
    step = 1e-6
    tangent = (rod.stress(sections + step * rate) - rod.stress(sections - step * rate)) / (2 * step)
    viscous = rod.viscous_stress(rate, sections)
    assert np.abs(viscous - tangent).max() < 1e-6 * np.abs(tangent).max()


@pytest.mark.parametrize("seed", range(3))
def test_a_stretch_is_braked_whatever_brakes_turns(bench, seed):
    """Rates along the principal axes, in any state."""
    rng = np.random.default_rng(seed)
    turn, stretches = Rotation.random(random_state=seed).as_matrix(), rng.uniform(0.7, 2.0, 3)
    rates = rng.normal(size=3)
    forces = []
    for share in (0.0, 0.5, 1.0):
        sling = band_of(bench)
        rod = ReferenceRod(sling, Parameters.of(NEO_HOOKEAN, FIVE, turn_damping=share))
        at, rate = np.zeros((2, sling.sections, 9))
        for state, size in ((at, stretches), (rate, rates)):
            columns = size[:, None] * turn  # F = R diag: columns k of F lie in its rows
            state[:, :3] = rod.sling.arc[:, None] * columns[0]
            state[:, 3:] = columns[1:].ravel()
        forces.append(rod.viscous_stress(rate, at))
    size = np.abs(forces[-1]).max()
    assert size > 0
    for force in forces[:-1]:
        np.testing.assert_allclose(force, forces[-1], atol=1e-12 * size)
