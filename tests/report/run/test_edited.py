"""Files edited by hand: the report is written as ever, or one clear line names the file."""

import json

import pytest

from pipeline.base.errors import UserError
from pipeline.report.run import report as reporting
from pipeline.report.run import write as writing
from tests.edited import edits
from tests.report.run.conftest import BAND, METHOD
from tests.report.run.toy_replay import toy_landscape, toy_replay

FILES = {
    "theta": f"data/theta/{BAND}/{METHOD}.json",
    "regions": f"data/clusters/{BAND}/{METHOD}.json",
    "policy": f"data/policies/{BAND}/{METHOD}/card.json",
}


@pytest.mark.parametrize("name", FILES)
def test_any_edit_is_one_line_or_a_report(name, template, root, params, monkeypatch) -> None:
    monkeypatch.setattr(reporting, "replay_method", toy_replay)
    monkeypatch.setattr(reporting, "landscape", toy_landscape)
    monkeypatch.setattr(reporting.Report, "picture", lambda _, name, *__: f"{name}.png")
    monkeypatch.setattr(writing, "write_page", lambda *_: None)
    path, refused, accepted = root / FILES[name], 0, 0
    for what, edited in edits(json.loads(path.read_text())):
        path.write_text(json.dumps(edited))
        try:
            writing.write(params, root)
            accepted += 1
        except UserError as error:
            line = str(error)
            assert str(path) in line and line.isprintable() and len(line) < 500, what
            refused += 1
        except Exception as error:
            pytest.fail(f"{what}: {error!r}")
    assert refused > accepted > 0
