"""What came out: one table, one picture, plain findings; and where the cards of the bands lie."""

from __future__ import annotations

from pathlib import Path

from pipeline.base.template import filled
from pipeline.report.run.chapters.findings import doubts, findings
from pipeline.report.run.figures.landings import misses
from pipeline.report.run.report import Report
from pipeline.report.run.tables import outcome as tables
from pipeline.report.run.tables.cells import markdown
from pipeline.report.run.tables.landings import LAUNCHED, of_kind


def outcome(report: Report) -> str:
    """The first chapters."""
    results, params, main = report.results, report.params, report.main
    table = tables.outcome_table(results, report.references, report.styles)
    recorded = [b for b in results.methods if params.bands[b].source == "recording"]
    trials = {band: methods[main].trials for band, methods in results.methods.items()}
    trials |= {band: dip.trials for band, dip in results.dips.items()}
    return filled(
        Path(__file__).with_name("outcome.md.j2"),
        results=results,
        table=markdown(table),
        virtual=(results.trials.kind == "virtual").any(),
        picture=table and _picture(report),
        identified=recorded and markdown(tables.values(results, recorded, main)),
        sentences=[*findings(report), *doubts(report)],
        bands=[
            (band, params.bands[band], launched.kind.isin(LAUNCHED).any())
            for band, launched in trials.items()
        ],
    )


def _picture(report: Report) -> str | None:
    trials = of_kind(report.results.trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return None
    shown = report.shown([m for m in report.params.run.methods if m in set(trials.method)])
    alt = "how far from its target each launch landed"
    return report.picture("landings", alt, misses, trials, report.results.least, shown)
