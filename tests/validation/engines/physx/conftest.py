import pytest

from pipeline.export.mesh import Tube
from pipeline.export.usd import EDGES, GRADING


@pytest.fixture(scope="session")
def tube(sling) -> Tube:
    return Tube.of(sling, EDGES, GRADING)
