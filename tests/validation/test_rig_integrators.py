"""The rig's other integrator: its Jacobian, closed forms, and what the campaign tells apart."""

from dataclasses import replace

import numpy as np
import pytest

from rig.physics import forces, launch
from rig.physics.servo import ABSENT
from rig.physics.string import GRAVITY
from rig.physics.world import bent_at, string_of
from rig.recorder.interaction import Interaction
from tests.project import with_
from validation.campaigns import rig_integrators as campaign


@pytest.fixture(scope="module")
def string(params):
    return string_of(with_(params, "rig", edges=16, tolerance=1e-4), "band1")


def test_the_band_of_the_jacobian_holds_all_of_it(string) -> None:
    y = string.state(bent_at(string, np.array([0.0, -0.3, -0.1])))
    y[1:-1] += np.random.default_rng(0).normal(0, 1e-3, y[1:-1].shape)
    data, flat = (string.band, ABSENT), y.ravel()
    options = campaign.banded(flat.size, data)
    packed, reach = options["jac"](0.0, flat), options["uband"]

    def rates(at: np.ndarray) -> np.ndarray:
        out = np.empty_like(at)
        forces.rates(0.0, at, out, data)
        return out

    for column in range(0, flat.size, 7):
        nudged = flat.copy()
        nudged[column] += forces.NUDGE
        dense = (rates(nudged) - rates(flat)) / forces.NUDGE
        rows = np.arange(flat.size)
        inside = abs(rows - column) <= reach
        values = packed[(rows - column + reach)[inside], column]
        np.testing.assert_allclose(values, dense[inside], atol=1e-6 * np.abs(dense).max() + 1e-9)
        assert not dense[~inside].any()


def test_a_flight_without_drag_is_a_parabola() -> None:
    position, velocity = np.array([0.0, 0.5]), np.array([3.0, 1.0])
    with campaign.by_lsoda(1e-8):
        landing = launch.fly(position, velocity, 0.0, 0.0)
    g = -GRAVITY[2]
    assert landing == pytest.approx(3.0 * (1.0 + np.sqrt(1.0 + 2 * g * 0.5)) / g, abs=1e-6)


def test_both_follow_a_swing_alike(string) -> None:
    y = string.state(bent_at(string, np.array([0.0, -0.30, 0.0])))
    times = np.linspace(0.0, 0.01, 5)
    ours = string.integrate(y, times, 1e-7)[1]
    with campaign.by_lsoda(1e-8):
        theirs = string.integrate(y, times, 1e-7)[1]
    assert not np.array_equal(ours, theirs)  # it was another integrator
    assert np.abs(ours - y)[..., :3].max() > 0.01
    np.testing.assert_allclose(ours[..., :3], theirs[..., :3], atol=1e-5)


def test_what_differs_is_told_by_when_it_does() -> None:
    seen = np.array([0.0, 1.0, 2.0])
    zeros = np.zeros((3, 4, 3))
    first = Interaction(np.ones((5, 3)), np.zeros((5, 3)), np.zeros((5, 3)), seen, zeros, 1.5)
    lines = zeros.copy()
    lines[1, 2, 0], lines[2, 0, 1] = 0.1, 0.5
    force = np.ones((5, 3))
    force[3, 0] += 0.25
    second = replace(first, lines=lines, force=force, slip_time=1.6)
    differences = campaign.apart(first, second)
    assert differences["nodes_held_m"] == pytest.approx(0.1)
    assert differences["nodes_swinging_m"] == pytest.approx(0.5)
    assert differences["force_n"] == pytest.approx(0.25)
    assert differences["slip_s"] == pytest.approx(0.1)
