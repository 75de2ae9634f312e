"""What the paper's evaluation has besides its tables: bullseye, sensitivity, its four figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.base.template import filled
from pipeline.report.drawing.styles import Styles
from pipeline.report.run import paper
from pipeline.report.run.figures.flights import flights
from pipeline.report.run.figures.hanging import hanging
from pipeline.report.run.figures.method import method
from pipeline.report.run.figures.overview import overview
from pipeline.report.run.report import Report
from pipeline.report.run.tables import evaluation as tables
from pipeline.report.run.tables.cells import markdown
from pipeline.report.run.tables.landings import LAUNCHED, of_kind

TARGETS = 101  # between the policies' nearest and farthest, at which a landing's slope is taken


def evaluation(report: Report) -> str:
    """The chapter, as far as its parts ran."""
    params, results, styles = report.params, report.results, report.styles
    shown = report.shown({report.main, *paper.BENCHMARK})  # as in the paper's figures, ours first
    path = np.linspace(*params.policy.targets, TARGETS)
    draws = {(r.band, r.method): report.draws(r, path) for r in results if r.method in shown}
    hits = tables.bullseye(results, styles)
    lengths = tables.hanging(params, results, tuple(shown)) if results.floors else None
    hung = tables.hanging_table(lengths, styles) if lengths else None
    alt = "bands that hang with a weight"
    return filled(
        Path(__file__).with_name("evaluation.md.j2"),
        overview=_overview(report, draws),
        search=_search(report),
        hits=markdown(hits, repeats=False),
        flights=hits and _flights(report, shown),
        sensitivity=markdown(tables.sensitivity(results, draws, styles), repeats=False),
        lengths=markdown(hung, repeats=False),
        hanging=lengths and report.picture("hanging", alt, hanging, lengths, styles),
    )


def _overview(report: Report, draws: dict[tuple[str, str], np.ndarray]) -> str | None:
    band, methods = next(iter(report.results.methods.items()))
    trials = of_kind(methods[report.main].trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return None
    drawing = report.results.episodes[band], report.replays[band][report.main]
    drawing = overview, *drawing, draws[band, report.main], trials, report.styles[report.main]
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
