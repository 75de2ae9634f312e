import pytest

from pipeline.export.mesh import Tube
from pipeline.export.usd import EDGES, GRADING, UsdBand
from sling2sim2real import Band, Model, Settings, Theta
from validation.engines import checks


@pytest.fixture(scope="session")
def sling(bench):
    """In place of the folder's: without air."""
    return checks.sling_of(bench)


@pytest.fixture(scope="session")
def tube(sling) -> Tube:
    return Tube.of(sling, EDGES, GRADING)


@pytest.fixture(scope="session")
def model(delivered) -> Model:
    band = Band(mass=0.023, diameter=0.010, rest_length=0.52, name="toy")
    return Model(band, Theta(1.8e5, 0.47, 2.4e-3, 0.7, 0.6), settings=Settings.coarse())


@pytest.fixture(scope="session")
def band(model) -> UsdBand:
    """Of an export, softer than what is wanted by a fifth."""
    return UsdBand(Tube.of(model.sling, EDGES, GRADING), 1.3e5, 0.47, 0.7)
