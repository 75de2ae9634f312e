"""A band with parameters written by hand, coarsely simulated; nothing of a run is needed."""

import sys

import numpy as np
import pytest

from sling2sim2real import Band, Identification, LaunchHistory, Settings, Theta
from tests.cli.conftest import sling

__all__ = ["sling"]


@pytest.fixture(scope="session")
def model() -> Identification:
    """With five samples, from 10 % less stiff to 10 % stiffer, of half to twice the damping."""
    theta = Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6, mooney_share=0.45, relaxation=0.02)
    band = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    samples = np.tile(theta.point, (5, 1))
    samples[:, 0] *= [0.9, 1.0, 1.1, 1.05, 0.95]
    samples[:, 2] *= [1.0, 2.0, 0.5, 1.5, 0.7]
    settings, history = Settings.coarse(), LaunchHistory(4.0, 2.0)
    return Identification(band, theta, history=history, settings=settings, samples=samples)


@pytest.fixture(scope="session")
def outside() -> list[str]:
    """Where other packages lie, but not this project."""
    return [path for path in sys.path if path.endswith(("-packages", "lib-dynload", ".zip"))] + [
        path for path in sys.path if path.rstrip("/").endswith(f"python3.{sys.version_info.minor}")
    ]
