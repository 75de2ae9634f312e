import pytest

from sling2sim2real import Band, Model, Settings, Theta


@pytest.fixture(scope="session")
def model(delivered) -> Model:
    band = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    return Model(band, Theta(1.8e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())
