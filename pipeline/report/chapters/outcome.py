"""What came out: one table, one picture, plain findings; and where the cards of the bands lie."""

from __future__ import annotations

from pipeline.report.chapters.findings import doubts, findings
from pipeline.report.figures.landings import misses
from pipeline.report.report import Report
from pipeline.report.tables import outcome as tables
from pipeline.report.tables.cells import markdown
from pipeline.report.tables.landings import LAUNCHED

INTRODUCTION = """\
# Report

From one recording of a robot that pulls and releases an elastic band, each method fits a simulator
of the band (parameters θ) and trains a slingshot policy in it. Then the policy's launches are
compared with launches that the simulator has never seen. The last stage of `dvc repro` writes this
file.

## What came out
"""
VIRTUAL = """\
*Virtual* launches are those of a rig in software, whose rubber follows another law than the
simulator."""
COLUMNS = """\
Columns: mean distance from the target; the *actuation floor*, which errors of draw and release
alone cost; launches that failed; mean of predicted less actual landing, in per cent of the
distance; how many landings lie in their predicted 90 % interval, and how wide that is."""
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
        kinds = set(results.trials.kind)
        text += [
            markdown(table),
            f"{COLUMNS} {VIRTUAL}\n" if "virtual" in kinds else f"{COLUMNS}\n",
        ]
        text += _picture(report)
    else:
        text.append(NOTHING)
    recorded = [b for b in results.methods if report.params.bands[b].source == "recording"]
    if recorded:
        words = "What the recordings say of the bands, with 90 % intervals:\n"
        text += [words, markdown(tables.values(results, recorded, report.main))]
    lines = [*findings(report), *doubts(report)]
    return "\n".join([*text, *(f"- {line}" for line in lines), "", _cards(report)])


def _picture(report: Report) -> list[str]:
    trials = report.results.trials
    trials = trials[trials.kind.isin(LAUNCHED) & trials.target.notna()]
    if trials.empty:
        return []
    floors = {band: one["mean_error_m"] for band, one in report.results.floors.items()}
    shown = report.shown([m for m in report.params.run.methods if m in set(trials.method)])
    alt = "how far from its target each launch landed"
    return [report.picture("landings", alt, misses, trials, floors, shown)]


def _cards(report: Report) -> str:
    bands, lines = report.params.bands, []
    for band in report.results.methods:
        about = bands[band]
        sizes = f"{about.mass * 1e3:g} g, {about.rest_length * 100:g} cm between the clamps"
        sizes += f", {about.diameter * 1e3:g} mm thick"
        whose = "the virtual rig" if about.source == "rig" else "a robot"
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
