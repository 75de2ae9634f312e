"""Names of files in texts and pictures: what is in them is shown, and does nothing."""

import re
from html import unescape
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

from sling2sim2real.base.errors import printable
from sling2sim2real.drawing.names import as_code, as_label, cell
from sling2sim2real.drawing.page import page
from tests.hostile import MARKUP

TEX = "$\\frac{a$.mcap"


@pytest.mark.filterwarnings("ignore:Glyph")
@pytest.mark.parametrize("name", MARKUP)
def test_any_name_can_be_drawn(name: str) -> None:
    figure = plt.figure()
    try:
        figure.suptitle(as_label(name), wrap=True)
        figure.gca().set_xticks([0.5], [as_label(name)])
        figure.canvas.draw()
    finally:
        plt.close(figure)


def test_tex_is_what_a_plain_name_would_be_read_as() -> None:
    figure = plt.figure()
    figure.suptitle(TEX)
    with pytest.raises(ValueError, match="frac"):
        figure.canvas.draw()
    plt.close(figure)
    short = plt.figure().text(0, 0, as_label("a$b$"))
    long = plt.figure().text(0, 0, "a$b")
    assert short.get_window_extent().width > long.get_window_extent().width
    plt.close("all")


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
