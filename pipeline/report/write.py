"""Write reports/: results, appendix, their pictures, tables and pages, summary.json and run.js."""

from __future__ import annotations

import re
from pathlib import Path

from pipeline.params import Params
from pipeline.report.chapters.appendix import appendix
from pipeline.report.chapters.evaluation import evaluation
from pipeline.report.chapters.outcome import outcome
from pipeline.report.chapters.paper_tables import paper_tables
from pipeline.report.metrics import summary
from pipeline.report.paper import METHOD
from pipeline.report.report import Report
from pipeline.report.run import write_run
from sling2sim2real.base.files import write_json, write_text
from sling2sim2real.drawing.page import page

# The chapters of each page: each makes its text of a Report, and writes what the text shows.
PAGES = {"README": (outcome, paper_tables, evaluation), "appendix": (appendix,)}
HTML = {"README": "index", "appendix": "appendix"}  # names of pages
LINK = re.compile(rf"\]\(((?:bands/[^)/]+/card/)?)({'|'.join(HTML)})\.md\)")
RUN = """\
<p id="run"></p>
<script src="run.js"></script>
<script>
if (window.run) {
  const about = Object.entries(run).map(([name, value]) => `${name}: ${value}`);
  document.getElementById("run").textContent = "This run. " + about.join(" · ");
}
</script>"""


def write(params: Params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    report = Report.of(params, Path(root))
    theirs = METHOD if METHOD in report.references[1:] else None
    write_json(report.folder / "summary.json", summary(report.results, report.main, theirs))
    for name, chapters in PAGES.items():
        markdown = "\n\n".join(chapter(report).rstrip() for chapter in chapters) + "\n"
        write_text(report.folder / f"{name}.md", markdown)
        write_page(report.folder, name, markdown)
    write_run(report.folder)


def write_page(folder: Path, name: str, markdown: str) -> None:
    """Write <name>.md as HTML into `folder`, where its pictures lie: a file that needs no network.

    Only run.js lies beside it, which says where and when it was written and may be missing. Links
    to texts become links to their pages. Raises UserError.
    """
    text = LINK.sub(lambda link: f"]({link[1]}{HTML[link[2]]}.html)", markdown)
    title = "Sling2Sim2Real: " + ("report" if name == "README" else name)
    write_text(folder / f"{HTML[name]}.html", page(text, folder, title, foot=RUN))
