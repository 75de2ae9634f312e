"""What came out: one table, one picture, plain findings; and where the cards of the bands lie."""

from __future__ import annotations

import pandas as pd

from pipeline.report.run.chapters.findings import doubts, findings
from pipeline.report.run.figures.landings import misses
from pipeline.report.run.report import Report
from pipeline.report.run.tables import outcome as tables
from pipeline.report.run.tables.cells import markdown
from pipeline.report.run.tables.landings import LAUNCHED, of_kind

INTRODUCTION = """\
# Report

From a recording of a robot that pulls and releases an elastic band, each method fits a simulator of
the band (parameters θ) and trains a slingshot policy in it. Then its launches are compared with
launches that the simulator has never seen. The last stage of `dvc repro` writes this file.

## What came out
"""
COLUMNS = """\
Centimetres are the mean distance from the target. Per cent are of the landing's distance: how far
the prediction is off on average, its signed mean (*bias*), and how wide its 90 % interval is."""
FLOOR = """\
The *actuation floor* is what even an oracle's draws miss by, for errors of draw and release."""
VIRTUAL = """\
*Virtual* launches are those of a rig in software, whose rubber follows another law than the
simulator."""
DIPS = """\
*Pull with a dip*: the same rubber recorded once more by the informative pull of `sling plan`, which
shows how it unloads; by the first method alone."""
NOTHING = """\
Nothing was launched in this run, so no landing error is known. The cards say where to draw. Put
measured landings into `data/trials/measured/<band>.csv` and run `dvc repro` to compare them with
the predictions.
"""


def outcome(report: Report) -> str:
    """The first chapters."""
    results = report.results
    table = tables.outcome(results, report.references, report.styles)
    text = [INTRODUCTION]
    if table:
        virtual = (results.trials.kind == "virtual").any()
        words = [COLUMNS, *([FLOOR] if results.floors else []), *([VIRTUAL] if virtual else [])]
        words += [DIPS] if results.dips else []
        text += [markdown(table), "\n".join(words) + "\n"]
        text += _picture(report)
    else:
        text.append(NOTHING)
    recorded = [b for b in results.methods if report.params.bands[b].source == "recording"]
    if recorded:
        words = "What the recordings say of the bands, with 90 % intervals:\n"
        text += [words, markdown(tables.values(results, recorded, report.main))]
    lines = [f"- {line}" for line in (*findings(report), *doubts(report))]
    return "\n".join([*text, *lines, *([""] if lines else []), _cards(report)])


def _picture(report: Report) -> list[str]:
    trials = of_kind(report.results.trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return []
    shown = report.shown([m for m in report.params.run.methods if m in set(trials.method)])
    alt = "how far from its target each launch landed"
    return [report.picture("landings", alt, misses, trials, report.results.least, shown)]


def _cards(report: Report) -> str:
    bands, lines, results = report.params.bands, [], report.results

    def trials_of(band: str) -> pd.DataFrame:
        dip = results.dips.get(band)
        return dip.trials if dip else results.methods[band][report.main].trials

    for band in (*report.results.methods, *report.results.dips):
        about = bands[band]
        sizes = f"{about.mass * 1e3:g} g, {about.rest_length * 100:g} cm between the clamps"
        sizes += f", {about.diameter * 1e3:g} mm thick"
        whose = "the virtual rig" if about.source == "rig" else "a robot"
        launched = trials_of(band).kind.isin(LAUNCHED).any()
        whose += "" if launched else "; no launch yet"
        lines.append(f"- [{band}](bands/{band}/README.md): {sizes}; recorded by {whose}")
    return "\n".join(
        [
            "## The bands\n",
            "Each band has a card: whether its simulator can be trusted, its values, the recording"
            " beside the simulation, and draws to launch from.\n",
            *lines,
            "",
        ]
    )
