"""A coarse band, its model, and an episode of it that the simulator itself made."""

import pytest

from sling2sim2real import Band, Model, Settings, Theta, episode_from_arrays, rehearse


@pytest.fixture(scope="session")
def settings() -> Settings:
    return Settings.coarse()


@pytest.fixture(scope="session")
def band() -> Band:
    return Band(mass=0.023, diameter=0.010, rest_length=0.52)


@pytest.fixture(scope="session")
def world(band, settings) -> Model:
    theta = Theta(2.2e5, 0.47, 2.4e-3, 0.8, 0.6, mooney_share=0.3, relaxation=0.01)
    return Model(band, theta, settings=settings)


@pytest.fixture(scope="session")
def arrays(world) -> dict:
    return rehearse(world)


@pytest.fixture(scope="session")
def episode(arrays):
    return episode_from_arrays(**arrays)
