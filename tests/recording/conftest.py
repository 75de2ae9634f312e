from __future__ import annotations

import pytest

from pipeline.params import Params, load
from tests.recording.bag import write_bag


@pytest.fixture(scope="session")
def params() -> Params:
    """The project's parameters with a window that suits the small recordings."""
    whole = load("params.yaml")
    episode = whole.episode.model_copy(update={"duration": 3.6, "samples": 120, "tail": 0.5})
    return whole.model_copy(update={"episode": episode})


@pytest.fixture(scope="session")
def seen(tmp_path_factory):
    """(path, truth) of a recording with pictures."""
    path = tmp_path_factory.mktemp("bag") / "seen.mcap"
    return path, write_bag(path)


@pytest.fixture(scope="session")
def blind(tmp_path_factory):
    """(path, truth) of a recording with black pictures, for what needs no band in them."""
    path = tmp_path_factory.mktemp("bag") / "blind.mcap"
    return path, write_bag(path, cameras=False, rate=500)
