"""The run in plain sentences, and what went wrong in it."""

from __future__ import annotations

import numpy as np

from pipeline.report.run import paper
from pipeline.report.run.chapters import repeated
from pipeline.report.run.report import Report
from pipeline.report.run.results import Result
from pipeline.report.run.tables.differences import Compared, compared
from pipeline.report.run.tables.landings import (
    LAUNCHED,
    intervals,
    landing_errors,
    of_kind,
    prediction_error,
)

BETTER, WORSE, SAME = "better", "worse", "no different within the noise of launches on"
CLAIMS = {  # of the paper, with the methods that its own lands nearer than
    repeated.CLAIMS[1]: paper.BENCHMARK,
    repeated.CLAIMS[3]: paper.OPTIMISERS,
    repeated.CLAIMS[4]: paper.ABLATIONS,
}
ENOUGH = 0.8  # of 90 % intervals hold the landing
WIDE = 3.0  # half-widths in mean errors; 2 would do for normal errors
CAVEAT = (
    "The comparisons hold for launches of these policies (95 % intervals), of one identification"
    " each: another recording or another seed may reverse them"
)
OWN = (
    "; and choices of ours were made with landings of the rig in sight"
    " ([decisions](../docs/decisions.md))"
)


def findings(report: Report) -> list[str]:
    """Some sentences of launches of one kind; fewer where less ran.

    Of the paper's findings the campaign on more recordings speaks, where its bands ran.
    """
    results, references = report.results, report.references
    sentences, some = [], list(results)
    for kind in LAUNCHED:
        if any((result.trials.kind == kind).any() for result in some):
            sentences += [*_errors(report, kind), *_predictions(report, kind)]
    rows = compared(results, references, report.params.trials.seed)
    if len(references) > 1:
        sentences += _beside(report, [row for row in rows if row.method == references[0]])
    claims = [
        sentence
        for claim, methods in CLAIMS.items()
        if paper.METHOD in references and (sentence := _claim(report, rows, claim, methods))
    ]
    caution = OWN * (repeated.OURS in references and bool(results.floors))
    caveat = [f"{CAVEAT}{caution}."] if rows else []
    if report.repeated and paper.METHOD in references:
        return [*sentences, *caveat, *repeated.claims(report.repeated, report.params)]
    return [*sentences, *claims, *caveat]


def _errors(report: Report, kind: str) -> list[str]:
    """How far from their targets the methods land."""
    words = []
    for method in report.references:
        means = {}
        for band, methods in report.results.methods.items():
            mean = landing_errors(of_kind(methods[method].trials, kind))["all"].mean
            if np.isfinite(mean):
                means[band] = mean
        if not means:
            continue
        text = f"**{report.styles[method].name}** {_between([100 * m for m in means.values()])} cm"
        floor_of = report.results.least if kind == "virtual" else {}
        floors = [means[band] / floor_of[band] for band in means if band in floor_of]
        if floors and method == report.main:
            text += f" ({_between(floors)} times the actuation floor)"
        words.append(text)
    if not words:
        return []
    return [f"Mean distance of {kind} launches from their target: {', '.join(words)}."]


def _predictions(report: Report, kind: str) -> list[str]:
    """How well the main method predicts where its launches land."""
    errors, biases, held, count, widths, off = [], [], 0, 0, [], []
    for methods in report.results.methods.values():
        trials = of_kind(methods[report.main].trials, kind)
        error = prediction_error(trials)["all"]
        if not error.launches:
            continue
        errors.append(100 * error.mean)
        biases.append(100 * error.bias)
        ranges = intervals(trials) if methods[report.main].confidence else None
        if ranges and ranges["all"].launches:
            held, count = held + ranges["all"].covered, count + ranges["all"].launches
            widths.append(100 * ranges["all"].width)
            off.append(error.mean)
    if not errors:
        return []
    name = report.styles[report.main].name
    sentence = (
        f"{name[0].upper()}{name[1:]} predicts where its {kind} launches land within"
        f" {_between(errors)} % of the distance on average (bias {_between(biases, '+.1f')} %)."
    )
    if not count:
        return [sentence]
    text = f"{held} of these {count} landings lie in their 90 % interval,"
    text += f" which is {_between(widths)} % wide"
    if held < ENOUGH * count:
        text += ": too few, so the intervals are too narrow"
    elif np.mean(widths) / 2 > WIDE * 100 * np.mean(off):
        text += ": wider than such errors call for"
    return [sentence, f"{text}."]


def _beside(report: Report, rows: list[Compared]) -> list[str]:
    """The main method beside the paper's."""
    by_verdict: dict[str, list[Compared]] = {}
    for row in rows:
        if paper.METHOD in row.beside:
            by_verdict.setdefault(_verdict(report, row), []).append(row)
    words = []
    for verdict, phrase in ((BETTER, "nearer on"), (WORSE, "further off on"), (SAME, SAME)):
        if some := by_verdict.get(verdict):
            where = f"{phrase} {_list(row.band for row in some)}"
            words.append(where + ("" if verdict == SAME else _by(some, " by")))
    if not words:
        return []
    name, theirs = (report.styles[method].name for method in report.references)
    return [f"Beside {theirs}, {name} lands {_list(words)}."]


def _claim(report: Report, rows: list[Compared], claim: str, methods: tuple[str, ...]) -> str:
    """Whether a finding of the paper's holds in this run; empty where nothing was tried."""
    tried: dict[str, list[Compared]] = {}
    for row in rows:
        if row.method in methods and row.method != paper.METHOD and paper.METHOD in row.beside:
            tried.setdefault(_verdict(report, row), []).append(row)
    bands = {row.band for some in tried.values() for row in some}
    several = len(bands) > 1

    def which(some: list[Compared]) -> str:
        names: dict[str, list[str]] = {}
        for row in some:
            name = report.styles[row.method].name.replace(", ", " with ")
            names.setdefault(name, []).append(row.band)
        return _list(f"{n} ({', '.join(on)})" if several else n for n, on in names.items())

    # what lands further off than the paper's method is what the finding says
    phrases = (
        (WORSE, "holds against", ", nearer by"),
        (BETTER, "does not hold against", ", further off by"),
    )
    parts = [
        f"{words} {which(tried[verdict])}{_by(tried[verdict], by)}"
        for verdict, words, by in phrases
        if verdict in tried
    ]
    parts += [f"is open against {which(tried[SAME])}"] if SAME in tried else []
    where = "" if several else f" on {next(iter(bands), '')}"
    return f"The paper's finding that {claim}{where} {'; '.join(parts)}." if parts else ""


def _by(rows: list[Compared], words: str) -> str:
    """Write differences as in " by 2.9 to 4.4 cm"; empty where no launches can be compared."""
    differences = [row.beside[paper.METHOD] for row in rows]
    sizes = [100 * abs(difference.mean) for difference in differences if difference is not None]
    return f"{words} {_between(sizes)} cm" if sizes else ""


def _verdict(report: Report, row: Compared) -> str:
    """A method beside the paper's. One none of whose launches counts is the worse of the two."""
    methods = report.results.methods[row.band]
    lost = []
    for method in (row.method, paper.METHOD):
        errors = landing_errors(of_kind(methods[method].trials, row.kind))["all"]
        lost.append(errors.failed == errors.launches)
    if lost[0] != lost[1]:
        return WORSE if lost[0] else BETTER
    difference = row.beside[paper.METHOD]
    if difference is None or not difference.real:
        return SAME
    return WORSE if difference.mean > 0 else BETTER


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


def _between(values: list[float], form: str = ".1f") -> str:
    """Write a range as in "1.0 to 2.6", or one number where they are the same."""
    ends = dict.fromkeys(format(end, form).replace("-", "−") for end in (min(values), max(values)))
    return " to ".join(ends)


def _list(words) -> str:
    """Write a list as in "a, b and c"."""
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
