"""Names of files in a text: what is in them is shown, and does nothing."""

import re
from html import unescape
from pathlib import Path

import pytest

from pipeline.base.errors import printable
from pipeline.report.drawing.names import as_code, cell
from pipeline.report.drawing.page import page
from tests.hostile import MARKUP


@pytest.mark.parametrize("name", MARKUP)
def test_a_name_is_shown_letter_by_letter(name: str, tmp_path: Path) -> None:
    table = f"| a | b |\n| --- | --- |\n| {cell(as_code(name))} | 1 |\n"
    html = page(f"# Card\n\n## Values\n\n- {as_code(name)}\n\n{table}", tmp_path, "A title")
    body = html[html.index("<main>") :]
    shown = [unescape(text) for text in re.findall("<code>(.*?)</code>", body, re.DOTALL)]
    assert shown == [printable(name)] * 2
    assert set(re.findall("<([a-z0-9]+)", body)) <= {
        *("main", "h1", "h2", "ul", "li", "code"),
        *("table", "thead", "tbody", "tr", "th", "td"),
    }
    assert body.count("<td>") == 2


def test_markup_that_is_not_code_would_be_obeyed(tmp_path: Path) -> None:
    """So the test above can fail; HTML in a text never counts."""
    html = page("## **a** <script>alert(1)</script>", tmp_path, "A title")
    assert "<strong>a</strong>" in html and "<script" not in html
