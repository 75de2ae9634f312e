"""What turns a stressed band is braked by: nothing, or the rate of the nominal stress."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sling2sim2real.simulator.parameters import Parameters
from validation.simulator.closed import String
from validation.simulator.experiment import band_of
from validation.simulator.reference import TURNS, ReferenceRod

THETA = (5e5, 0.42, 3e-3, 0.5, 0.6)


def taut(bench, share: float, seed: int, stretch: float) -> tuple[ReferenceRod, np.ndarray]:
    """A band in uniaxial stress, turned at random, and its sections (L, 9)."""
    sling = band_of(bench)
    theta = Parameters.of(sling.law, THETA, turn_damping=share)
    thick = np.sqrt(String.of(sling, THETA).volume(stretch) / stretch)
    sections = np.zeros((sling.sections, 9))
    sections[:, 0], sections[:, 4], sections[:, 8] = stretch * sling.arc, thick, thick
    turn = Rotation.random(random_state=seed)
    return ReferenceRod(sling, theta), turn.apply(sections.reshape(-1, 3)).reshape(-1, 9)


@pytest.mark.parametrize(("seed", "stretch"), [(0, 1.3), (1, 1.6), (2, 2.2)])
def test_a_rigid_turn_is_braked_by_its_share_of_the_old_form(bench, seed, stretch):
    """In full by s d times the rate of a stress that turns along, w x P; else by the share."""
    spin = 30 * np.random.default_rng(seed).normal(size=3)
    _, _, d, s = taut(bench, 1.0, seed, stretch)[0].parameters
    stresses = {}
    for share in (0.0, 0.5, 1.0):
        rod, sections = taut(bench, share, seed, stretch)
        rate = np.cross(spin, sections.reshape(-1, 3)).reshape(-1, 9)
        stresses[share] = rod.viscous_stress(rate, sections)
    full = s * d * np.cross(spin, rod.stress(sections))
    size = np.abs(full).max()
    np.testing.assert_allclose(stresses[1.0], full, atol=1e-8 * size)
    pull = String.of(rod.sling, THETA).force(stretch) * stretch / rod.sling.area
    left = TURNS / (TURNS + pull / rod.parameters[0])  # by what keeps the matrix regular
    for share in (0.0, 0.5):
        expected = (share + (1 - share) * left) * full
        np.testing.assert_allclose(stresses[share], expected, atol=1e-8 * size)
    assert left < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_a_stretch_is_braked_as_ever(bench, seed):
    """Rates along the principal axes, in any state."""
    rng = np.random.default_rng(seed)
    turn, stretches = Rotation.random(random_state=seed).as_matrix(), rng.uniform(0.7, 2.0, 3)
    rates = rng.normal(size=3)
    forces = []
    for share in (0.0, 0.5, 1.0):
        rod, sections = taut(bench, share, seed, 1.5)
        at, rate = np.zeros((2, *sections.shape))
        for state, size in ((at, stretches), (rate, rates)):
            columns = size[:, None] * turn  # F = R diag: columns k of F lie in its rows
            state[:, :3] = rod.sling.arc[:, None] * columns[0]
            state[:, 3:] = columns[1:].ravel()
        forces.append(rod.viscous_stress(rate, at))
    size = np.abs(forces[-1]).max()
    assert size > 0
    for force in forces[:-1]:
        np.testing.assert_allclose(force, forces[-1], atol=1e-12 * size)
