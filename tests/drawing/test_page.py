"""A text as a page: whole, alone, and the same twice."""

import base64
import re
from pathlib import Path

import pytest

from sling2sim2real.base.errors import UserError
from sling2sim2real.drawing.page import page

MARKDOWN = """\
# What came out

Before.

## In short

| a | b |
| --- | --- |
| 1.5 | x < y |

## Band & more

![picture](figures/one.png)
"""
PICTURE = b"\x89PNG of bytes"


@pytest.fixture
def html(tmp_path: Path) -> str:
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "one.png").write_bytes(PICTURE)
    return page(MARKDOWN, tmp_path, "A title")


def test_the_text_is_in_the_page_with_its_pictures(html: str) -> None:
    assert "<title>A title</title>" in html
    assert "<td>1.5</td>" in html and "<td>x &lt; y</td>" in html
    encoded = base64.b64encode(PICTURE).decode()
    assert f'src="data:image/png;base64,{encoded}"' in html
    for name, title in (
        ("chapter-1-in-short", "In short"),
        ("chapter-2-band-more", "Band &amp; more"),
    ):
        assert f'<a href="#{name}">{title}</a>' in html and f'<h2 id="{name}">{title}</h2>' in html
    order = ("Before.", 'id="chapter-1', 'id="chapter-2')
    places = [html.index(text) for text in order]
    assert places == sorted(places)


def test_the_page_asks_for_nothing(html: str) -> None:
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', html)[1]
    assert policy.startswith("default-src 'none'") and "http" not in policy
    for attribute in re.findall(r"""(?:src|href)=["']([^"']*)["']""", html):
        assert attribute.startswith(("data:", "#"))
    assert "@import" not in html and "<script" not in html


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="figures/one.png: cannot be read"):
        page(MARKDOWN, tmp_path, "")
