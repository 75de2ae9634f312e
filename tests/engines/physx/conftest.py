import pytest

from sling2sim2real.exporting.mesh import Tube
from sling2sim2real.exporting.usd import EDGES, GRADING


@pytest.fixture(scope="session")
def tube(sling) -> Tube:
    return Tube.of(sling, EDGES, GRADING)
