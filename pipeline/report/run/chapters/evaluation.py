"""What the paper's evaluation has besides its tables: bullseye, sensitivity, its four figures."""

from __future__ import annotations

import numpy as np
import pandas as pd

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
BULLSEYE = """\
### Within the bullseye

How many launches land within 20 cm of their target, the radius that the paper names. Launches that
failed are among those that missed. The paper counts no hits.
"""
SENSITIVITY = """\
### What 1 cm of draw does

By how much a landing moves if the draw is 1 cm off, in the worst direction, by each calibrated
simulator, over its policy's draws for all trained targets. The paper: "up to 30 cm".
"""
HANGING = """\
### Bands with 1.5 kg

Length of half a band under the weight, ten seconds after it is loaded; in brackets, how far a
simulator is off the rig's rubber. The paper's caption ("we clamp each rubber band at half of its
full length") can be read in two ways; the picture shows the first. *: stretched further than the
recording did.
"""
FLIGHTS = """\
Flights on the rig, and those that each simulator expects, which have no air. The recording's camera
sees the band alone, so these are drawn for a camera beside the sling.
"""


def evaluation(report: Report) -> str:
    """The chapter, as far as its parts ran."""
    text = ["## The paper's evaluation\n", *_overview(report), *_method(report)]
    return "\n".join([*text, *_hits(report), *_sensitivity(report), *_hanging(report)])


def _overview(report: Report) -> list[str]:
    band, methods = next(iter(report.results.methods.items()))
    one, style = methods[report.main], report.styles[report.main]
    trials = of_kind(one.trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return []
    path = report.draws(one, np.linspace(*report.params.policy.targets, TARGETS))
    recorded, played = report.results.episodes[band], report.replays[band][report.main]
    alt = "from a recording to launches"
    return [report.picture("overview", alt, overview, recorded, played, path, trials, style)]


def _method(report: Report) -> list[str]:
    if report.landscape is None:
        return []
    one, chart = report.landscape
    name = report.styles[one.method].name
    drawing = method, one, chart, report.params.parameters
    return [
        f"The search of {name} on the loss itself, over the plane of E and d through its θ*. Points"
        " have other values on the other axes, so the loss under them is not their own.\n",
        report.picture("method", "exploration, regions, CMA-ES", *drawing),
    ]


def _hits(report: Report) -> list[str]:
    results, styles = report.results, report.styles
    table = tables.bullseye(results, styles)
    if table is None:
        return []
    text, shown = [BULLSEYE, markdown(table, repeats=False)], _shown(report)
    for band, methods in results.methods.items():
        trials = pd.concat([one.trials for one in methods.values()], ignore_index=True)
        flew = set(trials.loc[trials.flight_y.notna()].method)
        flown = {m: style for m, style in shown.items() if m in flew}
        if flown:
            alt = f"flights of {band}"
            drawing = flights, of_kind(trials, "virtual"), report.params.setup, flown
            return [*text, f"{FLIGHTS}Here on {band}.\n", report.picture("flights", alt, *drawing)]
    return text


def _sensitivity(report: Report) -> list[str]:
    path = np.linspace(*report.params.policy.targets, TARGETS)
    shown = _shown(report)
    draws = {(r.band, r.method): report.draws(r, path) for r in report.results if r.method in shown}
    table = tables.sensitivity(report.results, draws, report.styles)
    return [SENSITIVITY, markdown(table, repeats=False)]


def _hanging(report: Report) -> list[str]:
    if not report.results.floors:
        return []
    rows = tables.hanging(report.params, report.results, tuple(_shown(report)))
    alt = "bands that hang with a weight"
    picture = report.picture("hanging", alt, hanging, rows, report.styles)
    return [HANGING, markdown(tables.hanging_table(rows, report.styles), repeats=False), picture]


def _shown(report: Report) -> dict:
    """The methods of the paper's figures, and ours first."""
    return report.shown({report.main, *paper.BENCHMARK})
