"""Launches: ballistics in closed form, failures by name.

tests/validation/simulator/test_limits.py holds their steps and energy.
"""

from dataclasses import replace

import numpy as np
import pytest

from sling2sim2real.simulator import launch
from sling2sim2real.simulator.launch import ballistic_landing
from sling2sim2real.simulator.model import GRAVITY
from tests.simulator.bands import DRAW, THETA, neo


def test_ballistic_landing_in_closed_form():
    angle, speed, height = np.deg2rad(35.0), 4.0, 0.52
    drop = np.sqrt((speed * np.sin(angle)) ** 2 + 2 * GRAVITY * height)
    expected = speed * np.cos(angle) * (speed * np.sin(angle) + drop) / GRAVITY
    landing = ballistic_landing(0.0, 0.0, speed * np.cos(angle), speed * np.sin(angle), -height)
    assert landing == pytest.approx(expected, rel=1e-12)


def test_failures_have_names(sling, launch_setup):
    strong = launch(sling, launch_setup, neo([5e6, 0.45, 2e-3, 0.5, 1.0]), DRAW, max_force=30.0)
    assert "30 N" in strong.failure[0] and np.isnan(strong.landing_y[0])
    assert strong.hold_force[0] > 30
    slack = launch(sling, launch_setup, neo(THETA), [-0.15, -0.05])
    assert slack.failure[0] is not None and np.isnan(slack.landing_y[0])


def test_a_projectile_that_passes_too_low_hits_the_fork(sling, launch_setup):
    """The same launch, with a foot that reaches above its way and one just below it."""
    draw = [-0.30, -0.05]
    free = launch(sling, launch_setup, neo(THETA), draw)
    assert free.failure == [None]
    time = -free.separation_y[0] / (free.speed[0] * np.cos(free.angle[0]))
    rise = free.speed[0] * np.sin(free.angle[0]) * time - GRAVITY * time**2 / 2
    above = free.separation_z[0] + rise + launch_setup.fork_height
    for foot, failure in ((0.99 * above, None), (1.01 * above, "hits the fork: too low")):
        done = launch(sling, replace(launch_setup, foot_height=foot), neo(THETA), draw)
        assert done.failure == [None] if failure is None else done.failure[0].startswith(failure)
