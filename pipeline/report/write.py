"""Write reports/: README.md, its pictures, tables and metrics, all in index.html, and run.js."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.base.files import write_json, write_text
from pipeline.report.chapters.appendix import budget, identification, policies
from pipeline.report.chapters.band import bands
from pipeline.report.chapters.pictures import pictures
from pipeline.report.chapters.summary import summary
from pipeline.report.page import write_page
from pipeline.report.report import Report
from pipeline.report.results import Result, Results
from pipeline.report.run import write_run
from pipeline.report.tables.benchmark import LAUNCHED
from pipeline.report.tables.landings import landing_errors, prediction_error
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
    write_page(report.folder, markdown)


def metrics(results: Results) -> dict[str, dict]:
    """What `dvc metrics show` shows, by "<band>-<method>": loss, errors in cm, shares in per cent.

    A key stands where there is such a number, so that a run of the rig shows nothing measured.
    """
    return {
        f"{one.band}-{one.method}": _of(one, results.floors.get(one.band, {})) for one in results
    }


def _of(result: Result, floor: dict) -> dict:
    entry = {
        "loss": _rounded(result.theta.get("loss", {}).get("total"), 1),
        "policy_cm": _rounded(result.card["training"]["mean_error_m"], 100),
    }
    if floor:
        entry["floor_cm"] = _rounded(floor["mean_error_m"], 100)
    groups = {kind: result.trials[result.trials.kind == kind] for kind in LAUNCHED}
    for name, trials in groups.items():
        if trials.target.notna().any() and set(trials.kind) != {"predicted"}:
            total = landing_errors(trials)["all"]
            entry[f"{name}_cm"] = _rounded(total["mean"], 100)
            entry[f"{name}_failed"] = total["failed"]
    if len(groups["measured"]):
        inside = prediction_error(groups["measured"])["inside"]
        entry["prediction_percent"] = _rounded(inside["mean"], 100)
    return entry


def _rounded(value: float | None, factor: float) -> float | None:
    """To four digits: another kind of CPU differs beyond them."""
    if value is None or not np.isfinite(value):
        return None
    return float(f"{factor * value:.4g}")
