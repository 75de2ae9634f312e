"""What came out: tables, a picture, what went wrong; and where the cards of the bands lie."""

from __future__ import annotations

from pathlib import Path

from pipeline.report.figures.landings import misses
from pipeline.report.report import Report
from pipeline.report.results import Result
from pipeline.report.tables import outcome as tables
from pipeline.report.tables.campaign import ABLATIONS, campaign_table
from pipeline.report.tables.cells import markdown
from pipeline.report.tables.landings import LAUNCHED, of_kind
from sling2sim2real.base.template import filled


def outcome(report: Report) -> str:
    """The first chapters."""
    results, params, main = report.results, report.params, report.main
    table = tables.outcome_table(results, report.references, report.styles)
    recorded = [b for b in results.methods if params.bands[b].source == "recording"]
    trials = {
        first.key: results.methods[band][main].trials for band, first in params.run.first.items()
    }
    trials |= {key: other.trials for key, other in results.others.items()}
    return filled(
        Path(__file__).with_name("outcome.md.j2"),
        results=results,
        table=markdown(table),
        virtual=(results.trials.kind == "virtual").any(),
        picture=table and _picture(report),
        identified=recorded and markdown(tables.values(results, recorded, main)),
        campaign=results.floors and markdown(campaign_table(report.root / ABLATIONS)),
        doubts=doubts(report),
        bands=[
            (
                key,
                params.bands[params.run.recordings[key].band],
                launched.kind.isin(LAUNCHED).any(),
            )
            for key, launched in trials.items()
        ],
    )


def _picture(report: Report) -> str | None:
    trials = of_kind(report.results.trials, *LAUNCHED)
    trials = trials.loc[trials.target.notna()]
    if trials.empty:
        return None
    shown = report.shown([m for m in report.results.shared if m in set(trials.method)])
    alt = "how far from its target each launch landed"
    return report.picture("landings", alt, misses, trials, report.results.least, shown)


def doubts(report: Report) -> list[str]:
    """What did not go well, a sentence each."""
    sentences = []
    for result in report.results:
        name = f"{result.band}, {report.styles[result.method].name}"
        sentences += [f"⚠ {name}: {words}" for words in _wrong(result)]
    return sentences + [
        f"⚠ {band}: {count} measured launches name a method that does not run on this band."
        for band, count in report.results.unused.items()
    ]


def _wrong(result: Result) -> list[str]:
    sentences, unpredicted = [], int(result.trials.predicted_y.isna().sum())
    if unpredicted:
        sentences.append(f"{unpredicted} of {len(result.trials)} launches could not be predicted.")
    if not result.card["training"]["converged"]:
        sentences.append("the policy did **not** converge in its own simulator.")
    if not result.confidence:
        return sentences
    if not result.confidence.get("settled", True):
        steps = result.confidence.get("steps", "all its")
        sentences.append(
            f"the fit had **not settled** after {steps} steps; do not rely on its intervals."
        )
    if not any(recording["pictures"] for recording in result.confidence["recordings"]):
        sentences.append(
            "no camera frame shows the recoil, so the damping is what other rubbers have; a launch"
            " would say most."
        )
    return sentences
