"""The command that exports bands and replays them: what its report has, and when."""

import json
import sys

import pytest

from sling2sim2real.base.errors import UserError
from validation import exports, reports

ROW = {"met": True, "engine": "an engine", "matched": [], "files": {}}


@pytest.fixture
def run(monkeypatch, tmp_path):
    """Run the command on bands whose export is a function of their name."""
    monkeypatch.setattr(exports, "REPORT", str(tmp_path / "{}.json"))
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
