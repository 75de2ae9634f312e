from pathlib import Path

import pytest

from pipeline.params import Params
from rig.recorder.interaction import Interaction
from rig.recorder.record import record
from tests import once
from tests.project import ROOT, with_

SCALE = 0.4  # of the pictures


@pytest.fixture(scope="session")
def coarse(params: Params) -> Params:
    """The world as params.yaml has it, integrated quickly; its recordings draw nothing."""
    return with_(params, "rig", edges=40, tolerance=1e-4, draws={})


@pytest.fixture(scope="session")
def shared() -> Path:
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip("needs ../shared, which is not part of the project")
    return folder


@pytest.fixture(scope="session")
def recorded(coarse: Params, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Interaction]:
    """One recording of the quick world, and what truly happened."""

    def make(folder: Path) -> tuple[Path, Interaction]:
        path = folder / "band1.mcap"
        return path, record(coarse, "band1", path, picture_scale=SCALE)

    return once.value(tmp_path_factory, "rig", make)
