"""The paper's tables 1 to 4, as far as they ran, as markdown, CSV and LaTeX."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pipeline.base.files import replacing, write_text
from pipeline.base.target import TARGET_AREA
from pipeline.report.run import paper
from pipeline.report.run.repeated import FILE, LEVEL
from pipeline.report.run.report import Report
from pipeline.report.run.results import Results
from pipeline.report.run.tables import benchmark, parameters
from pipeline.report.run.tables import repeated as campaign
from pipeline.report.run.tables.cells import latex, markdown

CAPTIONS = {
    1: "Landing error [cm] by band and method: mean ± deviation of |landing − target|; g in cm.",
    2: "Identified parameters, and the paper's loss of each calibrated simulator.",
    3: "Ablation of the optimiser: landing error [cm] as in table 1.",
    4: "Ablation of covariance (c), several starts (m) and the work term: landing error [cm] as"
    " in table 1.",
}
OVER = ("landing error [cm], g in cm", 4)  # above tables 1, 3 and 4, from that column on

INTRODUCTION = """\
## The paper's tables

Only what ran has rows. Bold: the lowest of a band and source, ties too, where two methods or more
have a cell in which no launch failed; it may be noise ([appendix](appendix.md)). The paper's cells
go by this rule as well: its table 1 has *Sling2Sim2Real* of band 3 bold, which stands alone there,
and its table 3 leaves out *Adam* at 172.5, a tie.
"""
SOURCES = {
    "virtual": "*virtual*: recorded or launched by the virtual rig.",
    "measured": "*measured*: recorded or launched by a robot.",
    benchmark.PAPER: f"*{benchmark.PAPER}*: what the authors of Sling2Sim2Real found, with other"
    " rubber, another rig and another simulator; it is no result of this run.",
}
BEFORE = {
    1: f"""\
Every policy launches at each target with the same errors of draw and release. *all targets*: ±
within targets; the next column: ± over all launches (the paper's "±" mixes the two). A launch fails
that does not land, takes more force than the arm may hold, or lands outside y = {TARGET_AREA[0]} –
{TARGET_AREA[1]} m; it is counted, and left out of the mean, which may flatter a method
of which some launches failed; the paper has no such cell. N/A: every launch failed, as in the
paper.
""",
    2: """\
θ: Young's modulus E, Poisson's ratio ν, elasticity damping d (viscous stress = d × rate of the
elastic stress), friction of the finger pads, damping scale s (share of d that acts on shape). A
pull hardly tells E from ν, or s from d: single values are less certain than what they do together.
The loss has the paper's terms (geometry + force + work), whatever the method minimised. Weights,
simulator and rubber are other than the paper's, so it compares within a source alone.
""",
    3: "Other searches of the paper's loss, with the same number of rollouts.\n",
    4: """\
The paper's method without its covariance (−c), with a single start (−m), and without the work term.
(The paper prints 7.83 for −c, −m over all targets; its own cells average 7.17, a tie with the full
method.)
""",
}
FLOOR = """\
*Actuation floor*: an oracle's draws, found on the rig itself, that hit without errors and are the
least sensitive to them, launched with errors as in the trials. No method has seen them.
"""
DOUBT = """\
In brackets: 90 % intervals, of methods that have a density; *prior*: without the recording; *not
identifiable*: the recording says hardly more than that; *fixed*: not searched.
[docs/identification.md](../docs/identification.md) says what such an interval is and is not.
"""
REPEATED = f"""\
The same on ten further recordings of each band, one search each. They took part in no choice; the
bands did. *all* pools the recordings, so that its interval and p hold for these three bands
([ablations.json](validation/{FILE.name})): mean distance [cm] of launches without errors of draw
and release, aimed by the simulator itself; 95 % intervals. *Beside*: the difference on the same
recordings; p: Wilcoxon's test with Holm's correction over all methods; bold where it is below
{LEVEL:g}.
"""
EDGE = "⚠ the search ended at a side of its box: the optimum may lie outside.\n"


def paper_tables(report: Report) -> str:
    """The chapter; writes table1.csv, table1.tex, ..., those that have rows."""
    params, results, named = report.params, report.results, report.styles
    folder = report.folder / "tables"
    found = parameters.identified(results, params)
    tables = {2: (parameters.as_table(found, named), parameters.records(found))}
    for count, rows in (
        (1, benchmark.benchmark(results)),
        (3, benchmark.ablation(results, paper.OPTIMISERS)),
        (4, benchmark.ablation(results, paper.ABLATIONS)),
    ):
        if rows:
            table = benchmark.as_table(rows, params.trials.targets, named)
            tables[count] = table, benchmark.records(rows)
    sources = {row[2] for table, _ in tables.values() for row in table[1]}
    known = (words for source, words in SOURCES.items() if source in sources)
    text = [INTRODUCTION, " ".join(known) + "\n"]
    for count, (table, records) in sorted(tables.items()):
        name, over = f"table{count}", None if count == 2 else (*OVER, len(table[0]) - 1)
        write_csv(folder / f"{name}.csv", records)
        write_text(folder / f"{name}.tex", latex(table, CAPTIONS[count], f"tab:{name}", over))
        text += [_titled(count, name, folder), BEFORE[count], markdown(table, repeats=False)]
        text += [FLOOR] if count == 1 and results.floors else []
        if report.repeated and count in campaign.ROWS:
            text += [REPEATED, *_other_settings(report)]
            text += [markdown(campaign.as_table(report.repeated, count))]
        text += _notes(results, found) if count == 2 else []
    return "\n".join(text)


def _other_settings(report: Report) -> list[str]:
    """A line where the campaign ran with other settings than this run."""
    different = report.repeated.changed_settings(report.params) if report.repeated else []
    if not different:
        return []
    listed = "; ".join(
        str(one).replace(" was ", " ").replace(", is ", ", here ") for one in different
    )
    return [f"⚠ These recordings were searched with other settings than this run: {listed}.\n"]


def _notes(results: Results, found: list[parameters.IdentifiedRow]) -> list[str]:
    """How to read table 2."""
    edges = any(value.at_edge for row in found for value in row.values.values())
    trusted = any(result.confidence for result in results)
    return [*([DOUBT] if trusted else []), *([EDGE] if edges else [])]


def _titled(count: int, name: str, folder: Path) -> str:
    csv, tex = (f"{folder.name}/{name}.{end}" for end in ("csv", "tex"))
    return f"### Table {count}\n\n{CAPTIONS[count]} [CSV]({csv}), [LaTeX]({tex})\n"


def write_csv(path: Path, records: pd.DataFrame) -> None:
    """Write a table for machines."""
    with replacing(path) as temporary:
        records.to_csv(temporary, index=False, float_format="%.4g", lineterminator="\n")
