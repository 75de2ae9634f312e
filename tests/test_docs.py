"""What README and docs point at is there."""

import re
import subprocess

from tests.project import ROOT

LINK = re.compile(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)")
CODE = re.compile(r"`((?:app|docs|pipeline|reports|stages|tests|tools|validation)/[\w./-]+)`")
IGNORED = {"reports/index.html", "reports/run.js"}  # by Git; a run writes them


def test_links_and_paths_of_every_page_are_there() -> None:
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"]
    pages = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    named = []
    for page in map(ROOT.joinpath, pages.split()):
        if page.is_file():
            text = page.read_text(encoding="utf-8")
            named += [(page, page.parent / one) for one in LINK.findall(text)]
            named += [(page, ROOT / one) for one in CODE.findall(text) if one not in IGNORED]
    assert len(named) > 50
    assert [(str(page), str(one)) for page, one in named if not one.exists()] == []
