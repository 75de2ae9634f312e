from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.params import load
from pipeline.verify.check import Bench


@pytest.fixture(scope="session")
def bench() -> Bench:
    return Bench(load(Path(__file__).parents[2] / "params.yaml"))
