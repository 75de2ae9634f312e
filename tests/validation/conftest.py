import pytest

from pipeline.params import Params
from sling2sim2real.simulator.model import ClampedBand
from validation.simulator.finding import Bench


@pytest.fixture(scope="session")
def bench(params: Params) -> Bench:
    return Bench(params)


@pytest.fixture(scope="session")
def sling(params: Params) -> ClampedBand:
    return ClampedBand.of(params.bands["band1"], params.setup, params.sling)
