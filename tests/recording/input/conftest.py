"""The recording that the tests of its file share."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def whole(blind) -> Path:
    return blind[0]
