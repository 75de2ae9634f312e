"""The committed launches of the paper's method in the paper's engine, as the report reads them."""

import json
from pathlib import Path

import pytest

from pipeline.base.errors import UserError
from pipeline.report.run.physx import FOLDER, NAME, launched
from pipeline.report.run.tables.landings import landing_errors
from tests.project import ROOT


def test_launches_by_band_and_those_that_fail(tmp_path: Path) -> None:
    file = tmp_path / FOLDER / NAME.format("band1")
    file.parent.mkdir(parents=True)
    targets = [{"target_m": 1.9, "on_rig_m": [1.8, None]}, {"target_m": 2.1, "on_rig_m": [2.3]}]
    file.write_text(json.dumps({"targets": targets}))
    (trials,) = launched(tmp_path, ["band1", "band2"]).values()
    errors = landing_errors(trials)
    assert (errors[1.9].launches, errors[1.9].failed) == (2, 1)
    assert errors[1.9].mean == pytest.approx(0.1) and errors[2.1].bias == pytest.approx(0.2)
    file.write_text("{}")
    with pytest.raises(UserError, match="is not what .*policy writes .*git checkout"):
        launched(tmp_path, ["band1"])


def test_the_committed_file_has_launches_at_each_target() -> None:
    (trials,) = launched(ROOT, ["band1"]).values()
    assert trials.groupby("target").size().tolist() == [5, 5, 5]
