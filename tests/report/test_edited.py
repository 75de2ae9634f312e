"""Files edited by hand: the report is written as ever, or one clear line names the file."""

import json

import pytest

from pipeline.report.report import write
from tests.edited import outcomes
from tests.report.conftest import PAIR

pytestmark = pytest.mark.slow

FILES = {
    "theta": f"data/theta/{PAIR}.json",
    "regions": f"data/clusters/{PAIR}.json",
    "policy": f"data/policies/{PAIR}/card.json",
}


@pytest.mark.parametrize("name", FILES)
def test_any_edit_is_one_line_or_a_report(name, root, params, no_simulation, text_alone) -> None:
    path = root / FILES[name]
    content = json.loads(path.read_text())
    accepted, refused = outcomes(path, content, lambda: write(params, root))
    assert refused > accepted > 0
