from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.params import load
from validation.simulator.finding import Bench


@pytest.fixture(scope="session")
def bench() -> Bench:
    return Bench(load(Path(__file__).parents[3] / "params.yaml"))
