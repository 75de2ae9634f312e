"""A hanging weight against two straight strings in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from pipeline.params import load
from pipeline.sling.hang import hang
from pipeline.sling.model import GRAVITY, Sling
from validation.simulator.closed import String

THETAS = np.array([[2e5, 0.47, 2e-3, 0.5, 0.5], [6e5, 0.35, 2e-3, 0.5, 0.5]])
LOAD = 1.5


@pytest.fixture(scope="module")
def sling() -> Sling:
    params = load()
    return Sling.of(params.bands["band1"], params.setup, params.sling)


def depth_of_strings(sling: Sling, theta: np.ndarray, load: float) -> float:
    """Where the pull of two straight weightless strings carries the load [m]."""
    string, half = String.of(sling, theta), sling.rest_length / 2

    def pull(depth: float) -> float:
        length = np.hypot(depth, sling.half_width)
        return 2 * float(string.force(length / half)) * depth / length - load * GRAVITY

    return brentq(pull, np.sqrt(half**2 - sling.half_width**2), 5.0)


def test_a_weight_hangs_as_deep_as_two_strings_let_it(sling) -> None:
    light = replace(sling, mass=1e-4)
    nodes = hang(light, THETAS, LOAD)
    expected = [depth_of_strings(light, theta, LOAD) for theta in THETAS]
    assert abs(expected[0] - expected[1]) > 0.1
    np.testing.assert_allclose(-nodes[:, sling.middle, 2], expected, rtol=0.005)
    np.testing.assert_allclose(nodes[:, [0, -1]], np.broadcast_to(sling.tips, (2, 2, 3)), atol=1e-6)
    np.testing.assert_allclose(nodes[:, sling.middle, :2], 0, atol=1e-3)


def test_a_heavier_weight_hangs_deeper_and_so_does_a_heavier_band(sling) -> None:
    middle = sling.middle
    deeper = [-hang(sling, THETAS[0], load)[0, middle, 2] for load in (0.5, 1.0, 1.5)]
    assert np.all(np.diff(deeper) > 0.02)
    light = -hang(replace(sling, mass=sling.mass / 10), THETAS[0], LOAD)[0, middle, 2]
    assert light < deeper[-1] < 1.02 * light
