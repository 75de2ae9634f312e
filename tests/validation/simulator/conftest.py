import pytest

from validation.simulator.finding import Bench


@pytest.fixture(scope="session")
def bench(params) -> Bench:
    return Bench(params)
