"""A sling for the tests: the default resolution, a band of 10 mm and 23 g."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sling2sim2real.base.minimum_jerk import minimum_jerk
from sling2sim2real.episode.episode import Episode
from sling2sim2real.simulator import ClampedBand, LaunchSetup


@pytest.fixture(scope="session")
def sling(params):
    band = SimpleNamespace(mass=0.023, diameter=0.01, rest_length=0.52, preconditioned=False)
    return ClampedBand.of(band, params.setup, params.sling)


@pytest.fixture(scope="session")
def launch_setup(params):
    """By an arm that does not give way."""
    return replace(LaunchSetup.of(params.setup, params.sling), arm_stiffness=None)


@pytest.fixture(scope="session")
def strong_grip(sling):
    """Pads that hold any band, so that no theta slips out."""
    return replace(sling, grip_force=1e5)


@pytest.fixture(scope="session")
def episode():
    """Three seconds: grasp at 0.2 s, lift and pull by 2 s, hold, release at 2.4 s."""
    time = 0.015 + 0.03 * np.arange(100)
    smooth = minimum_jerk((time - 0.3) / 1.6)
    position = np.outer(1 - smooth, [0.0, 0.0, -0.2]) + np.outer(smooth, [0.0, -0.4, 0.0])
    return Episode(
        band="test",
        time=time,
        position=position,
        velocity=np.gradient(position, 0.03, axis=0),
        force=np.zeros((100, 3)),
        opening=np.full(100, np.nan),
        cloud_time=np.arange(90) / 30,
        clouds=[np.zeros((0, 3), np.float32)] * 90,
        grasp_time=0.2,
        release_time=2.4,
        camera=np.array([0.8, 0.3, 0.5]),
    )
