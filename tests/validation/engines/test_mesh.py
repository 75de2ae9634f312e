"""The band as other engines take it, its force, and the comparison where MuJoCo is missing."""

import numpy as np
import pytest

from sling2sim2real.exporting.mesh import CLAMPED_LENGTH_M, Tube
from validation.simulator.closed import String

THETA = np.array([2.2e5, 0.45, 3e-3, 1.0, 1.0])


def elastic_force(tube: Tube, positions: np.ndarray, theta) -> np.ndarray:
    """Force of the stretched band on each vertex [N], like `positions` (sections, V, 3).

    The law of material.h: nominal stress P = mu F + (lam (J - 1) - mu) cof F in each tetrahedron.
    """
    young, poisson = theta[:2]
    mu = young / (2 * (1 + poisson))
    lam = young * poisson / ((1 + poisson) * (1 - 2 * poisson)) + mu
    before, now = (
        np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        for corners in (v.reshape(-1, 3)[tube.tetrahedra] for v in (tube.rest, positions))
    )
    inverse = np.linalg.inv(before)
    gradient = now @ inverse
    ratio = np.linalg.det(gradient)[:, None, None]
    cofactor = ratio * np.swapaxes(np.linalg.inv(gradient), 1, 2)
    stress = mu * gradient + (lam * (ratio - 1) - mu) * cofactor
    shares = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    pull = -np.einsum("t,tij,tkj->tki", np.linalg.det(before) / 6, stress, shares)
    force = np.zeros((len(tube.mass), 3))
    np.add.at(force, tube.tetrahedra, pull)
    return force.reshape(tube.rest.shape)


def test_it_weighs_as_much_as_the_band_and_what_is_in_the_clamps(sling):
    tube = Tube.of(sling)
    whole = 1 + 2 * CLAMPED_LENGTH_M / sling.rest_length
    assert tube.mass.sum() == pytest.approx(sling.mass * whole)
    assert tube.arc[[0, -1]] == pytest.approx([0, sling.rest_length])
    assert tube.rest[tube.middle, 0, 0] == pytest.approx(sling.rest_length / 2)


def test_it_hangs_in_the_clamps_unstretched(sling):
    tube = Tube.of(sling)
    tips = tube.clamped[[1, -2], 0]
    assert tips == pytest.approx(sling.tips, abs=1e-12)
    assert tube.clamped[0, 0] - tips[0] == pytest.approx(-CLAMPED_LENGTH_M * sling.clamp_direction)
    edges = np.linalg.norm(np.diff(tube.hanging[1:-1, 0], axis=0), axis=1)
    assert edges == pytest.approx(np.diff(tube.arc), rel=0.01)


@pytest.mark.parametrize("rings", [1, 2])
def test_its_force_is_the_closed_form_of_a_straight_string(sling, rings):
    tube, string, stretch = Tube.of(sling, rings=rings), String.of(sling, THETA), 1.7
    across = np.sqrt(string.volume(stretch) / stretch)
    force = elastic_force(tube, tube.rest * [stretch, across, across], THETA)
    pull = float(string.force(stretch))
    ends = force.sum(axis=1)
    assert ends[[0, -1]] == pytest.approx(np.array([[pull, 0, 0], [-pull, 0, 0]]), abs=1e-9)
    assert force[1:-1] == pytest.approx(np.zeros(force[1:-1].shape), abs=1e-9)
