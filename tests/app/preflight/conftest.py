"""The recordings of tests/recording, looked at once."""

import pytest

from app.preflight.check import Look, look_at
from tests.recording.conftest import blind, masked, params, seen

__all__ = ["blind", "masked", "params", "seen"]


@pytest.fixture(scope="session")
def looked(seen, params) -> Look:
    """A recording that can be used."""
    return look_at(seen[0], params)


@pytest.fixture(scope="session")
def refused(blind, params) -> Look:
    """A recording whose pictures show no band."""
    return look_at(blind[0], params)
