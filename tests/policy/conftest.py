from types import SimpleNamespace

import pytest

from sling2sim2real.launching.surface.landing_map import LandingMap
from tests import once
from tests.policy import toy

SETTINGS = SimpleNamespace(
    seed=1,
    targets=(1.425, 2.425),
    exploration="scheduled",
    envs=256,
    steps=4,
    iterations=40,
    hidden=(256, 128, 64),
    learning_rate=1e-3,
    init_std=0.5,
    final_std=0.005,
    reward=SimpleNamespace(height=5.0, scale=1.0, penalty=1.0),
)


@pytest.fixture(scope="session")
def settings() -> SimpleNamespace:
    return SETTINGS


@pytest.fixture(scope="session")
def toy_map() -> LandingMap:
    """With a force limit that cuts the box, so that training meets failures."""
    return LandingMap.simulate(
        toy.launch, draw_y=toy.DRAW_Y, draw_z=toy.DRAW_Z, size=(33, 25), max_force=15.0
    )


@pytest.fixture(scope="session")
def trained(toy_map, tmp_path_factory: pytest.TempPathFactory):
    from sling2sim2real.policy.train import train

    return once.value(tmp_path_factory, "trained", lambda _: train(toy_map, SETTINGS))


@pytest.fixture(scope="session")
def seeing(toy_map, tmp_path_factory: pytest.TempPathFactory):
    """A policy that sees the projectile too."""
    from sling2sim2real.policy.train import train

    return once.value(
        tmp_path_factory,
        "seeing",
        lambda _: train(toy_map, SETTINGS, projectile=toy.START),
    )
