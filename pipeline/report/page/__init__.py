"""reports/index.html: the report as one file without a network, with a replay to turn and play.

Its content security policy forbids every request but for run.js beside it, which says where and
when it was written and may be missing. Equal inputs give equal bytes.
"""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from string import Template

from pipeline.base.errors import UserError
from pipeline.base.files import write_text
from pipeline.report.page.replays import content
from pipeline.report.report import Report

HERE = Path(__file__).parent


def write_page(report: Report, markdown: str) -> None:
    """Write reports/index.html.

    Args:
        markdown: The report as text; its pictures lie in reports/.

    Raises:
        UserError: A picture of the report is missing.
    """
    from plotly.offline import get_plotlyjs

    body, chapters = _rendered(markdown, report.folder)
    first, _, rest = body.partition(chapters[1][2]) if len(chapters) > 1 else (body, "", "")
    links = [("replay", "The replay"), *(chapter[:2] for chapter in chapters)]
    data = json.dumps(content(report), separators=(",", ":"))
    page = Template((HERE / "page.html").read_text("utf-8")).substitute(
        style=(HERE / "page.css").read_text("utf-8"),
        navigation="\n".join(f'<a href="#{name}">{title}</a>' for name, title in links),
        first=first,
        rest=(chapters[1][2] if len(chapters) > 1 else "") + rest,
        data=data.replace("</", "<\\/"),
        plotly=get_plotlyjs(),
        script=(HERE / "replay.js").read_text("utf-8"),
    )
    write_text(report.folder / "index.html", page)


def _rendered(markdown: str, folder: Path) -> tuple[str, list[tuple[str, str, str]]]:
    """HTML with its pictures inside; id, title and opening tag of each chapter."""
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = parser.parse(markdown)
    chapters: list[tuple[str, str, str]] = []
    for token, inline in zip(tokens, [*tokens[1:], None], strict=True):
        if token.type == "heading_open" and token.tag == "h2":
            title = parser.renderer.render(inline.children, parser.options, {})
            name = f"chapter-{len(chapters) + 1}-{_slug(inline.content)}"
            token.attrSet("id", name)
            chapters.append((name, title, f'<h2 id="{name}">'))
        for child in token.children or []:
            if child.type == "image":
                child.attrSet("src", _inside(folder / str(child.attrGet("src"))))
                child.attrSet("loading", "lazy")
    return parser.renderer.render(tokens, parser.options, {}), chapters


def _slug(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def _inside(picture: Path) -> str:
    """A picture as an address that holds it."""
    try:
        content = picture.read_bytes()
    except OSError as error:
        raise UserError(
            f"{picture}: cannot be read ({error.strerror}); `dvc repro --force report` draws it"
        ) from error
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"
