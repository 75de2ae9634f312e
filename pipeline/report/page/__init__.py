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
    links = [("replay", "The replay"), *chapters]
    begins = [match.start() for match in re.finditer("<h2 ", body)]
    second = begins[1] if len(begins) > 1 else len(body)  # the replay comes before it
    data = json.dumps(content(report), separators=(",", ":"))
    page = Template((HERE / "page.html").read_text("utf-8")).substitute(
        style=(HERE / "page.css").read_text("utf-8"),
        navigation="\n".join(f'<a href="#{name}">{title}</a>' for name, title in links),
        first=body[:second],
        rest=body[second:],
        data=data.replace("</", "<\\/"),
        plotly=get_plotlyjs(),
        script=(HERE / "replay.js").read_text("utf-8"),
    )
    write_text(report.folder / "index.html", page)


def _rendered(markdown: str, folder: Path) -> tuple[str, list[tuple[str, str]]]:
    """HTML with its pictures inside; id and title of each chapter."""
    from markdown_it import MarkdownIt

    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens, chapters = parser.parse(markdown), []
    for token, inline in zip(tokens, [*tokens[1:], None], strict=True):
        if token.type == "heading_open" and token.tag == "h2":
            title = parser.renderer.render(inline.children, parser.options, {})
            slug = re.sub(r"[^a-z0-9]+", "-", inline.content.lower()).strip("-")
            token.attrSet("id", f"chapter-{len(chapters) + 1}-{slug}")
            chapters.append((token.attrGet("id"), title))
        for child in token.children or []:
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
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"
