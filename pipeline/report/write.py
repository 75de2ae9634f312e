"""Write reports/: README.md, its pictures, tables and metrics, all in index.html, and run.js."""

from __future__ import annotations

from pathlib import Path

from pipeline.base.files import write_json, write_text
from pipeline.report.chapters.appendix import budget, policies
from pipeline.report.chapters.band import bands
from pipeline.report.chapters.identification import identification
from pipeline.report.chapters.pictures import pictures
from pipeline.report.chapters.summary import summary
from pipeline.report.metrics import metrics
from pipeline.report.page import write_page
from pipeline.report.report import Report
from pipeline.report.run import write_run
from pipeline.report.tables.paper_tables import paper_tables

# Each makes its text of a Report, and writes the pictures and tables that the text names.
CHAPTERS = (summary, paper_tables, pictures, bands, identification, policies, budget)


def write(params, root: str | Path = ".") -> None:
    """Write the report of everything in params.run. Raises UserError where an input is missing."""
    report = Report.of(params, Path(root))
    markdown = "\n".join(chapter(report) for chapter in CHAPTERS)
    for name, content in metrics(report.results).items():
        write_json(report.folder / "metrics" / f"{name}.json", content)
    write_text(report.folder / "README.md", markdown)
    write_run(report.folder)
    write_page(report, markdown)
