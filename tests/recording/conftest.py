from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.params import Params, load
from tests import once
from tests.recording.bag import Truth, write_bag


@pytest.fixture(scope="session")
def params() -> Params:
    """The project's parameters with a window that suits the small recordings."""
    whole = load("params.yaml")
    episode = whole.episode.model_copy(update={"duration": 3.6, "samples": 120, "tail": 0.5})
    return whole.model_copy(update={"episode": episode})


@pytest.fixture(scope="session")
def seen(tmp_path_factory):
    """(path, truth) of a recording with pictures."""
    return written(tmp_path_factory, "seen.mcap")


@pytest.fixture(scope="session")
def blind(tmp_path_factory):
    """(path, truth) of a recording with black pictures, for what needs no band in them."""
    return written(tmp_path_factory, "blind.mcap", cameras=False, rate=500)


def written(factory: pytest.TempPathFactory, name: str, **options) -> tuple[Path, Truth]:
    """A recording for all tests of the run."""

    def make(folder: Path) -> tuple[Path, Truth]:
        return folder / name, write_bag(folder / name, **options)

    return once.value(factory, name, make)
