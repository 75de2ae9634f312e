"""The paper's tables 1 to 4 as markdown, CSV and LaTeX, and what their differences are worth."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pipeline.base.files import replacing, write_text
from pipeline.base.target import TARGET_AREA
from pipeline.drawing.styles import Styles
from pipeline.report import paper
from pipeline.report.noise import LEVEL, RESAMPLES
from pipeline.report.report import Report
from pipeline.report.results import Results
from pipeline.report.tables import benchmark, differences, parameters
from pipeline.report.tables.cells import latex, markdown, percent

CAPTIONS = {
    1: "Landing error [cm] by band and method: mean ± deviation of |landing − target|; g in cm.",
    2: "Identified parameters, and the paper's loss of each calibrated simulator.",
    3: "Ablation of the optimiser: landing error [cm] as in table 1.",
    4: "Ablation of covariance (c), several starts (m) and the work term: landing error [cm] as"
    " in table 1.",
}
OVER = ("landing error [cm], g in cm", 4)  # above tables 1, 3 and 4, from that column on

INTRODUCTION = f"""\
## The paper's tables

Laid out as in the paper, its own number below each of ours. *virtual*: launches on the virtual rig,
whose rubber follows another law than the simulator that was fitted. *measured*: launches of a
user. *{benchmark.PAPER}*: what the authors of Sling2Sim2Real measured, with other rubber on another
rig; their numbers are no result of this run. *{benchmark.NOT_RUN}*: the paper has it, this run has
not. Bold: the lowest of a band, which may be noise: see below.
"""
BEFORE = {
    1: f"""\
Each policy was trained in the simulator that its method had calibrated, and launched at each target
with the same errors of draw and release as every other. Mean ± deviation (of a sample) of
|landing − target|; *all targets*: ± within targets, and in the next column over all launches, which
the paper's "±" mixes. A launch fails that does not land, takes more force than the arm may hold, or
lands outside y = {TARGET_AREA[0]} – {TARGET_AREA[1]} m; it is counted, and left out of the mean.
N/A: every launch fails.
""",
    2: """\
θ = Young's modulus E, Poisson's ratio ν, elasticity damping d (viscous stress = d × rate of the
elastic stress), friction of the finger pads, and damping scale s (share of d that acts on shape).
E and ν are nearly interchangeable in the force, and mostly the product of s and d can be seen, so
single values are less certain than the behaviour that they give together. The loss is the paper's
(geometry + force + work), computed in each calibrated simulator, whatever its method minimised. The
paper's parameters are those of another simulator and other rubber.
""",
    3: "Other searches of the paper's loss, with the same number of rollouts.\n",
    4: """\
The paper's method without its covariance (−c), with a single start (−m), and without the work term.
The paper prints 7.83 for −c, −m over all targets; its own cells average 7.17, a tie with the full
method.
""",
}
FLOOR = """\
*Actuation floor*: an oracle's draws, found on the rig itself, that hit without errors and are the
least sensitive to them, launched with errors as in the trials. No method has seen them.
"""
DOUBT = """\
In brackets: 90 % intervals, of the methods that are one density; *not identifiable* where it says
hardly more than the box; *fixed* where the method does not search.
[docs/identification.md](../docs/identification.md) says what such an interval is and is not.
"""
EDGE = "⚠ the search ended at a side of its box: the optimum may lie outside.\n"
NO_CONFIDENCE = "No θ of this run comes with a confidence.\n"
NOISE = f"""\
### Which differences are more than noise

By how much a method misses more (+) or less (−) than another: difference of the mean |landing −
target| in cm, averaged over the targets that both reach, with its {percent(LEVEL)} interval by a
bootstrap over launches ({RESAMPLES:,} resamples within each target). Virtual launches of equal
number share their errors and are compared in pairs; measured ones are not. Bold: the interval
leaves out zero. Failed launches are left out, with their pairs, so that a policy that fails more is
compared where it lands; the lines below say so. Each interval stands alone: of twenty true ties,
one is expected to look like a difference.

The intervals hold for **launches of these policies**, not for the methods at large: each method
identified each band once, from one recording and with one seed, and what another recording or seed
would give is not in them.
"""


def paper_tables(report: Report) -> str:
    """The chapter; writes table1.csv, table1.tex, ... table4.tex and differences.csv."""
    params, results, named = report.params, report.results, report.styles
    folder = report.folder / "tables"
    found = parameters.identified(results, params)
    tables = {2: (parameters.as_table(found, named), parameters.records(found))}
    for count, rows in (
        (1, benchmark.benchmark(results)),
        (3, benchmark.ablation(results, paper.OPTIMISERS)),
        (4, benchmark.ablation(results, paper.ABLATIONS)),
    ):
        table = benchmark.as_table(rows, params.trials.targets, named)
        tables[count] = table, benchmark.records(rows)
    text = [INTRODUCTION]
    for count, (table, records) in sorted(tables.items()):
        name, over = f"table{count}", None if count == 2 else (*OVER, len(table[0]) - 1)
        _write_csv(folder / f"{name}.csv", records)
        write_text(folder / f"{name}.tex", latex(table, CAPTIONS[count], f"tab:{name}", over))
        text += [_titled(count, name, folder), BEFORE[count], markdown(table, repeats=False)]
        text += [FLOOR] if count == 1 and results.floors else []
        text += _doubt(results, found, named) if count == 2 else []
    return "\n".join([*text, *_noise(params, results, named, folder)])


def _titled(count: int, name: str, folder: Path) -> str:
    csv, tex = (f"{folder.name}/{name}.{end}" for end in ("csv", "tex"))
    return f"### Table {count}\n\n{CAPTIONS[count]} [CSV]({csv}), [LaTeX]({tex})\n"


def _doubt(results: Results, found: list[parameters.IdentifiedRow], named: Styles) -> list[str]:
    """How to read table 2."""
    edges = any(value.at_edge for row in found for value in row.values.values())
    trusted = any(result.confidence for result in results)
    unsettled = [
        f"⚠ The fit of {one.band}, {named[one.method].name} had **not settled** after"
        f" {one.confidence['steps']} steps. Its intervals are not to be relied on.\n"
        for one in results
        if not one.confidence.get("settled", True)
    ]
    unseen = [
        f"⚠ No picture shows the recoil of {one.band}: {named[one.method].name} has its damping"
        " from what other rubbers have, and a launch would say most.\n"
        for one in results
        if one.confidence and not any(r["pictures"] for r in one.confidence["recordings"])
    ]
    notes = [*([EDGE] if edges else []), *unsettled, *unseen]
    return [DOUBT if trusted else NO_CONFIDENCE, *notes]


def _noise(params, results: Results, named: Styles, folder: Path) -> list[str]:
    text, seed = [], params.trials.seed
    rows = differences.compared(results, seed)
    if rows:
        _write_csv(folder / "differences.csv", differences.records(rows))
        table = markdown(differences.as_table(rows, named), repeats=False)
        text += [NOISE, table, "\n".join(differences.claims(rows, named)) + "\n"]
    return text


def _write_csv(path: Path, records: pd.DataFrame) -> None:
    with replacing(path) as temporary:
        records.to_csv(temporary, index=False, float_format="%.4g", lineterminator="\n")
