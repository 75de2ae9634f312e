from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.params import Params, load

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def params() -> Params:
    return load(ROOT / "params.yaml")


@pytest.fixture(scope="session")
def coarse(params: Params) -> Params:
    """The same world, integrated quickly."""
    rig = params.rig.model_copy(update={"edges": 40, "tolerance": 1e-4})
    return params.model_copy(update={"rig": rig})


@pytest.fixture(scope="session")
def shared() -> Path:
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip("needs ../shared, which is not part of the project")
    return folder
