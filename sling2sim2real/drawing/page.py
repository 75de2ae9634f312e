"""A text as one page without a network: its pictures are inside, and each chapter has a link.

The content security policy forbids every request and script. Equal inputs give equal bytes.
"""

from __future__ import annotations

import base64
import re
from itertools import pairwise
from pathlib import Path

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.template import filled

HERE = Path(__file__).parent


def page(markdown: str, folder: Path, title: str) -> str:
    """The page as HTML.

    Args:
        folder: Where the text's pictures lie.

    Raises:
        UserError: A picture is missing.
    """
    body, chapters = _rendered(markdown, folder)
    return filled(
        HERE / "page.html.j2",
        title=title,
        style=(HERE / "page.css").read_text("utf-8"),
        navigation="\n".join(f'<a href="#{id_}">{name}</a>' for id_, name in chapters),
        body=body,
    )


def _rendered(markdown: str, folder: Path) -> tuple[str, list[tuple[str, str]]]:
    """HTML with its pictures inside; id and title of each chapter."""
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens, chapters = parser.parse(markdown), []
    for token, inline in pairwise(tokens):
        if token.type == "heading_open" and token.tag == "h2":
            title = parser.renderer.render(inline.children or [], parser.options, {})
            slug = re.sub(r"[^a-z0-9]+", "-", inline.content.lower()).strip("-")
            token.attrSet("id", f"chapter-{len(chapters) + 1}-{slug}")
            chapters.append((token.attrGet("id"), title))
        for child in inline.children or []:
            if child.type == "image":
                child.attrSet("src", _inside(folder / str(child.attrGet("src"))))
                child.attrSet("loading", "lazy")
    return parser.renderer.render(tokens, parser.options, {}), chapters


def _inside(picture: Path) -> str:
    """A picture as an address that holds it."""
    try:
        content = picture.read_bytes()
    except OSError as error:
        raise UserError(
            f"{picture}: cannot be read ({error.strerror}); `dvc repro --force report` draws it"
        ) from error
    kind = picture.suffix[1:]
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"
