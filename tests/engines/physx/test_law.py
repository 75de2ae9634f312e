"""PhysX's law: its stress is its energy's slope, and a straight string pulls by its closed form."""

import numpy as np
import pytest
from scipy.optimize import brentq

from sling2sim2real.engines.physx import law
from sling2sim2real.exporting import usd
from sling2sim2real.exporting.mesh import Tube

YOUNG, POISSON = 2.2e5, 0.45


def turn(seed: int) -> np.ndarray:
    left, _, right = np.linalg.svd(np.random.default_rng(seed).standard_normal((3, 3)))
    return left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right


def energy(gradient: np.ndarray) -> float:
    mu, lam = law.lame(YOUNG, POISSON)
    left, _, right = np.linalg.svd(gradient)
    rotation = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    volume = np.linalg.det(gradient)
    return mu * ((gradient - rotation) ** 2).sum() + lam / 2 * (volume - 1) ** 2


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_stress_is_the_slope_of_the_energy(seed):
    random = np.random.default_rng(seed)
    gradient = turn(seed) @ (np.eye(3) + 0.3 * random.standard_normal((3, 3)))
    slope = np.empty((3, 3))
    for i, j in np.ndindex(3, 3):
        step = np.zeros((3, 3))
        step[i, j] = 1e-6
        slope[i, j] = (energy(gradient + step) - energy(gradient - step)) / 2e-6
    assert law.stress(gradient, YOUNG, POISSON) == pytest.approx(slope, rel=1e-5, abs=YOUNG / 1e6)


def test_the_force_on_a_section_is_the_slope_of_the_bands_energy(sling):
    tube, random = Tube.of(sling, edges=6, grading=1.0), np.random.default_rng(6)
    places = tube.rest * 1.3 + 2e-4 * random.standard_normal(tube.rest.shape)
    slope = []
    for axis in np.eye(3):
        step = np.zeros(places.shape)
        step[tube.middle] = 1e-7 * axis
        slope.append((energy_of(tube, places - step) - energy_of(tube, places + step)) / 2e-7)
    force = law.force_on(tube, [tube.middle], places, YOUNG, POISSON)
    assert force == pytest.approx(slope, rel=1e-5)


def energy_of(tube: Tube, nodes: np.ndarray) -> float:
    """Of a whole band [J]."""
    before, gradients = law._gradients(tube, tube.tetrahedra, nodes)
    return np.linalg.det(before) / 6 @ [energy(gradient) for gradient in gradients]


@pytest.mark.parametrize("poisson", [0.30, 0.45, 0.49])
def test_a_straight_string_is_free_of_stress_across(sling, poisson):
    """The force of its tetrahedra, of two bands at once, is the closed form's."""
    tube, stretch = Tube.of(sling, edges=6, grading=1.0), 1.9
    across = brentq(
        lambda ratio: law.stress(np.diag([stretch, ratio, ratio]), YOUNG, poisson)[1, 1], 0.4, 1.0
    )
    pull = YOUNG * usd.nominal(stretch, poisson) * sling.area
    positions = np.stack([tube.rest, tube.rest * [stretch, across, across]])
    young = np.array([YOUNG, YOUNG])
    first, inside, last = (
        law.force_on(tube, sections, positions, young, np.full(2, poisson))
        for sections in ([0], [3], [len(tube.rest) - 1])
    )
    assert first[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert first[1] == pytest.approx([pull, 0, 0], rel=1e-4, abs=1e-6)
    assert last[1] == pytest.approx([-pull, 0, 0], rel=1e-4, abs=1e-6)
    assert inside == pytest.approx(np.zeros((2, 3)), abs=1e-6)
