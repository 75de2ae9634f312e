from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.params import Params, load
from sling2sim2real.episode.episode import Episode
from sling2sim2real.recording.build import Checked, episode_of, process
from sling2sim2real.recording.masks.ridge import RidgeMask
from tests import once
from tests.project import DEFAULTS, with_
from validation.recordings.bag import Truth, write_bag


@pytest.fixture(scope="session")
def params() -> Params:
    """The project's parameters with a window that suits the small recordings."""
    whole = load(DEFAULTS)
    return with_(whole, "episode", duration=3.6, samples=120, tail=0.5)


@pytest.fixture(scope="session")
def seen(tmp_path_factory):
    """(path, truth) of a recording with pictures."""
    return written(tmp_path_factory, "seen.mcap")


@pytest.fixture(scope="session")
def checked(seen, params) -> Checked:
    """`seen`, worked out once; to be read only."""
    return process(seen[0], params.bands["band1"], params)


@pytest.fixture(scope="session")
def episode(checked, params) -> Episode:
    """Of `seen`; to be read only."""
    return episode_of(checked, "band1", params)


@pytest.fixture(scope="session")
def masked(seen, params, tmp_path_factory) -> Path:
    """`seen`, with the masks that RidgeMask made of it beside it; to be read only."""

    def make(folder: Path) -> None:
        shutil.copy(seen[0], folder / "masked.mcap")
        (folder / "masked.masks").mkdir()
        view = process(seen[0], params.bands["band1"], params).view
        ridge = RidgeMask(view)
        for number, frame in view.frames():
            whole = np.zeros(view.depth(number).shape, np.uint8)
            whole[view.window] = 255 * ridge.mask(frame)
            Image.fromarray(whole).save(folder / "masked.masks" / f"{view.stamp(number)}.png")

    return once.folder(tmp_path_factory, "masked", make) / "masked.mcap"


@pytest.fixture(scope="session")
def blind(tmp_path_factory):
    """(path, truth) of a recording with black pictures, for what needs no band in them."""
    return written(tmp_path_factory, "blind.mcap", cameras=False, rate=500)


def written(factory: pytest.TempPathFactory, name: str, **options) -> tuple[Path, Truth]:
    """A recording for all tests of the run."""

    def make(folder: Path) -> tuple[Path, Truth]:
        return folder / name, write_bag(folder / name, **options)

    return once.value(factory, name, make)
