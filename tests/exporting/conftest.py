"""A band with parameters written by hand, coarsely simulated; nothing of a run is needed."""

import sys

import pytest

from sling2sim2real import Band, LaunchHistory, Model, Settings, Theta
from tests.cli.conftest import sling

__all__ = ["sling"]


@pytest.fixture(scope="session")
def model() -> Model:
    theta = Theta(2.2e5, 0.47, 2.4e-3, 0.7, 0.6, mooney_share=0.45, relaxation=0.02)
    band = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    return Model(band, theta, history=LaunchHistory(4.0, 2.0), settings=Settings.coarse())


@pytest.fixture(scope="session")
def outside() -> list[str]:
    """Where other packages lie, but not this project."""
    return [path for path in sys.path if path.endswith(("-packages", "lib-dynload", ".zip"))] + [
        path for path in sys.path if path.rstrip("/").endswith(f"python3.{sys.version_info.minor}")
    ]
