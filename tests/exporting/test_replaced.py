"""What an export may replace: an empty folder, or an earlier export and nothing else."""

import json

import pytest

from sling2sim2real.exporting.export import replaceable

CARD = {"target": "usd", "files": {"band.usda": "the band", "README.md": "how to use it"}}


@pytest.mark.parametrize(
    ("files", "card", "may"),
    [
        ((), None, True),
        (("band.usda", "README.md"), CARD, True),
        (("band.usda", "README.md", "mine.txt"), CARD, False),
        (("policy.onnx",), {"band": "band1", "training": {}}, False),  # a policy's
        (("README.md", "force.png"), {"band": "band1", "verdict": "no"}, False),  # a band's
        (("band.usda",), None, False),
        (("band.usda",), [], False),
    ],
)
def test_only_an_export_is_replaced(tmp_path, files, card, may) -> None:
    for name in files:
        (tmp_path / name).write_text("")
    if card is not None:
        (tmp_path / "card.json").write_text(json.dumps(card))
    assert replaceable(tmp_path) == may
    assert not replaceable(tmp_path / "card.json")
