"""The stage floor where targets are out of reach: it says so, and the others have their floor."""

import sys
from pathlib import Path

import numpy as np
import pytest
from ruamel.yaml import YAML

from pipeline.report.data import Floor
from sling2sim2real.base.schema import read_json
from stages import floor
from tests.project import DEFAULTS


@pytest.fixture
def run(tmp_path: Path, monkeypatch):
    """Runs the stage on band1, coarsely, with other values in `setup`; what it wrote."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SLING_WORKERS", "1")
    monkeypatch.setattr(sys, "argv", ["", "band1"])

    def floor_of(**setup) -> dict:
        yaml = YAML()
        content = yaml.load(DEFAULTS)
        content["rig"].update({"edges": 24, "tolerance": 1e-3})
        content["floor"].update({"map_size": [4, 4], "launches": 0})
        content["trials"].update({"targets": [1.6, 2.3], "repeats": 2})
        content["setup"].update(setup)
        yaml.dump(content, tmp_path / "params.yaml")
        floor.main()
        return read_json(Path("data/floor/band1.json"), Floor).model_dump()

    return floor_of


@pytest.mark.slow
def test_a_target_out_of_reach_has_no_floor(run, capsys) -> None:
    both = run()
    assert both["failed"] == 0 and capsys.readouterr().err == ""
    near = run(draw_y=[-0.32, -0.25], draw_z=[-0.15, -0.10])
    message = capsys.readouterr()
    assert near["targets"]["1.6"]["mean_error_m"] is not None
    far = near["targets"]["2.3"]
    assert (far["draw"], far["mean_error_m"], far["failed"]) == (None, None, 2)
    assert np.isclose(near["mean_error_m"], near["targets"]["1.6"]["mean_error_m"])
    assert "warning: band1: no launch lands at 2.3 m, which has no floor; raise" in message.err
    assert "2 launches failed" in message.out
    assert run(max_force=1.0)["mean_error_m"] is None
    assert "band1: floor no launch lands" in capsys.readouterr().out
