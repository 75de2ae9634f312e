"""What the paper's evaluation has besides its tables: bullseye, its figures 1, 2 and 4."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.report import paper
from pipeline.report.figures.flights import flights
from pipeline.report.figures.method import method
from pipeline.report.figures.overview import overview
from pipeline.report.report import Report
from pipeline.report.tables import evaluation as tables
from pipeline.report.tables.cells import markdown
from pipeline.report.tables.landings import LAUNCHED, of_kind
from sling2sim2real.base.template import filled
from sling2sim2real.drawing.styles import Styles

TARGETS = 101  # of the policy's path that is drawn, from the nearest to the farthest


def evaluation(report: Report) -> str:
    """The chapter, as far as its parts ran."""
    results, styles = report.results, report.styles
    shown = report.shown({report.main, *paper.BENCHMARK})  # as in the paper's figures, ours first
    hits = tables.bullseye(results, styles)
    return filled(
        Path(__file__).with_name("evaluation.md.j2"),
        overview=_overview(report),
        search=_search(report),
        hits=markdown(hits, repeats=False),
        flights=hits and _flights(report, shown),
    )


def _overview(report: Report) -> str | None:
    band, methods = next(iter(report.results.methods.items()))
    trials = of_kind(methods[report.main].trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return None
    drawing = report.results.episodes[band], report.replays[band][report.main]
    targets = np.linspace(*report.params.policy.targets, TARGETS)
    draws = report.draws(methods[report.main], targets)
    drawing = overview, *drawing, draws, trials, report.styles[report.main]
    return report.picture("overview", "from a recording to launches", *drawing)


def _search(report: Report) -> tuple[str, str] | None:
    """Name of the method of the search that is drawn, and its picture; None where there is none."""
    if report.landscape is None:
        return None
    result, chart = report.landscape
    drawing = method, result, chart, report.params.parameters
    alt = "exploration, regions, CMA-ES"
    return report.styles[result.method].name, report.picture("method", alt, *drawing)


def _flights(report: Report, shown: Styles) -> tuple[str, str] | None:
    """The first band whose flights are known, and their picture; None where there is none."""
    for band, methods in report.results.methods.items():
        trials = pd.concat([result.trials for result in methods.values()], ignore_index=True)
        flew = set(trials.loc[trials.flight_y.notna()].method)
        if flown := {method: style for method, style in shown.items() if method in flew}:
            drawing = flights, of_kind(trials, "virtual"), report.params.setup, flown
            return band, report.picture("flights", f"flights of {band}", *drawing)
    return None
