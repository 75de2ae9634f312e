"""The campaign of two runs: what differs is named, and what only the second has does not count."""

import json
import shutil
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from tests.project import ROOT
from validation.campaigns import twice


@pytest.fixture
def compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Compare two runs with these outputs; the exit status and what is written."""

    def compare(*outputs: dict[str, str]) -> tuple[int, dict]:
        folders = [tmp_path / name for name in ("one", "two")]
        for folder, told in zip(folders, outputs, strict=True):
            (folder / twice.TABLE).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / twice.TABLE, folder / twice.TABLE)
            outs = [{"path": path, "md5": digest} for path, digest in told.items()]
            YAML().dump({"stages": {"all": {"outs": outs}}}, folder / "dvc.lock")
        report = tmp_path / "twice.json"
        monkeypatch.setattr("sys.argv", ["", *map(str, folders), "--report", str(report)])
        return twice.main(), json.loads(report.read_text())

    return compare


def test_equal_runs_and_one_that_has_more(compared) -> None:
    status, content = compared({"a": "1", "b": "2"}, {"a": "1", "b": "2", "c": "3"})
    assert status == 0
    assert (content["met"], content["outputs"], content["differing"]) == (True, 2, [])
    landings = content["landings_cm"]
    assert {"band1 least_squares", "band3 sling2sim2real"} <= landings.keys()
    assert all(one["these_runs"] == one["committed"] for one in landings.values())


def test_what_differs_or_lacks_is_named(compared) -> None:
    status, content = compared({"a": "1", "b": "2", "c": "3"}, {"a": "1", "b": "x"})
    assert status == 1
    assert (content["met"], content["differing"]) == (False, ["b", "c"])
