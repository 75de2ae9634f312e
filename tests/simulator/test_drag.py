"""The air's drag on the band: a force for mass and speed, which the projectile does not feel."""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.simulator.model import GRAVITY, ClampedBand
from sling2sim2real.simulator.records import Grip
from sling2sim2real.simulator.schedule import steps
from tests.simulator.bands import along_x, neo, stepped

THETA = [3e5, 0.45, 2e-3, 0.5, 1.0]
H, COUNT = 1e-3, 60


def fallen(sling: ClampedBand, drags: np.ndarray, payload=0.0, stretch=1.0) -> np.ndarray:
    """How far the middle of loose bands falls with each drag [1/s], (N,).

    Args:
        payload: At the middle [kg].
    """
    loose = replace(sling, clamped=(False, False), air_density=0.0)
    table, start = steps(H * np.arange(COUNT + 1), H, grip=Grip.FREE), along_x(loose, stretch)
    done = stepped(loose, table, neo(THETA, air_drag=drags), start, payload=payload)
    return start[sling.middle, 2] - done.state[:, sling.middle, 2]


def fall(rate: float) -> float:
    """Of one mass: backward Euler of v' = -g - rate v, which is exact for these steps."""
    speed = place = 0.0
    for _ in range(COUNT):
        speed = (speed + H * GRAVITY) / (1 + H * rate)
        place += H * speed
    return place


def test_a_loose_band_falls_as_one_mass_in_the_wind(params):
    drags = np.array([0.0, 3.0, 40.0])
    band = ClampedBand.of(params.bands["band1"], params.setup, params.sling)
    distances = fallen(band, drags, stretch=1.3)  # contracting as it falls
    assert distances == pytest.approx([fall(drag) for drag in drags], rel=1e-5)


def test_the_projectile_feels_no_wind(sling):
    """A stiff band with a load at its middle falls as both masses with the drag of one."""
    stiff = replace(sling, rest_length=0.02, mass=0.02)
    (distance,) = fallen(stiff, np.array([30.0]), payload=0.04)
    assert distance == pytest.approx(fall(30.0 * 0.02 / 0.06), rel=0.02)


def test_air_brakes_a_band_as_a_cylinder_across_the_wind_and_not_along_it(sling):
    """Speed v_t tanh(g t / v_t), v_t² = 2 m g / (rho C d L); end first it falls free."""
    light = replace(sling, clamped=(False, False), mass=2e-3, air_density=1.2)
    terminal = np.sqrt(
        2 * light.mass * GRAVITY / (1.2 * 1.1 * 2 * light.radius * light.rest_length)
    )
    table = steps(H * np.arange(301), H, grip=Grip.FREE, order=2)
    table[0] = steps([0.0, H], H, grip=Grip.FREE)[0]
    start, time = along_x(light, 1.0), 0.3
    done = stepped(light, table, neo(THETA), start)
    summary = terminal**2 / GRAVITY * np.log(np.cosh(GRAVITY * time / terminal))
    assert summary < 0.9 * GRAVITY * time**2 / 2  # it counts
    fallen = start[:, 2] - done.state[0, :, 2]
    assert fallen == pytest.approx(np.full(len(fallen), summary), rel=5e-3)
    upright = start[:, [1, 2, 0, 4, 5, 3, 7, 8, 6]]
    done = stepped(light, table, neo(THETA), upright)
    drop = (upright[:, 2] - done.state[0, :, 2]).mean()
    assert drop == pytest.approx(GRAVITY * time**2 / 2, rel=5e-3)
