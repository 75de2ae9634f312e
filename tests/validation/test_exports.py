"""The command that exports bands and replays them: what its report has, and when."""

import json
import sys
from queue import Queue

import pytest

from pipeline.base.errors import UserError
from tests.project import ROOT
from validation import exports, reports

ROW = {"met": True, "engine": "an engine", "matched": [], "files": {}}


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command on bands whose export is a function of their name."""
    monkeypatch.setattr(exports, "REPORT", str(tmp_path / "{}.json"))
    monkeypatch.setattr(exports, "gpus", lambda: ("cuda:0",))
    monkeypatch.setattr(reports, "environment", lambda *of: {"versions": {}})  # of a GPU

    def command(exported, *bands: str) -> dict:
        monkeypatch.setattr(exports, "exported", exported)
        monkeypatch.setattr(sys, "argv", ["exports", "--to", "usd", *bands])
        exports.main()
        return json.loads((tmp_path / "usd.json").read_text("utf-8"))

    return command


def test_the_report_has_each_band_and_whether_all_are_met(run) -> None:
    done = run(lambda target, band: ROW | {"met": band == "one"}, "one", "two")
    assert list(done["bands"]) == ["one", "two"] and done["met"] is False
    assert done["bands"]["one"] == {"met": True, "engine": "an engine", "matched": []}
    assert run(lambda target, band: ROW, "one")["met"] is True


def test_a_command_that_ends_early_has_written_the_bands_before(run, tmp_path) -> None:
    def exported(target: str, band: str) -> dict:
        if band == "two":
            raise UserError("PhysX: out of memory")
        return ROW

    with pytest.raises(UserError, match="out of memory"):
        run(exported, "one", "two")
    done = json.loads((tmp_path / "usd.json").read_text("utf-8"))
    assert list(done["bands"]) == ["one"] and done["met"] is False


def test_each_gpu_has_a_band_of_its_own(monkeypatch) -> None:
    """No band is exported here: there is no such run. But both were begun, each elsewhere."""
    monkeypatch.setattr(exports, "gpus", lambda: ("cuda:0", "cuda:1"))
    monkeypatch.chdir(ROOT)
    with pytest.raises(UserError):
        list(exports._cards("usd", ["no_such_band", "nor_this"], "cuda:0"))


def test_a_process_sees_its_gpu_alone(monkeypatch) -> None:
    free = Queue()
    for number in (1, 0):
        free.put(number)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,7")
    monkeypatch.setenv("SLING_DEVICE", "cuda:1")
    exports._take_gpu(free)
    assert exports.os.environ["CUDA_VISIBLE_DEVICES"] == "7"
    assert exports.os.environ["SLING_DEVICE"] == "cuda"  # CUDA sees one alone
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES")
    exports._take_gpu(free)
    assert exports.os.environ.pop("CUDA_VISIBLE_DEVICES") == "0"
