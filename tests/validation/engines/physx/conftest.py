from pathlib import Path

import pytest

from pipeline.export import usd
from sling2sim2real import Band, Model, Settings, Theta, export


@pytest.fixture(scope="session")
def model(delivered) -> Model:
    band = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    return Model(band, Theta(1.8e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())


@pytest.fixture(scope="module")
def without_physx():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(usd, "match_of", lambda target: None)
        yield


@pytest.fixture(scope="module")
def folder(model, without_physx, tmp_path_factory) -> Path:
    """Of an export for PhysX."""
    return export(model, "usd", tmp_path_factory.mktemp("stage") / "usd").folder
