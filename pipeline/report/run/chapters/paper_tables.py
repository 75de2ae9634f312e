"""The paper's tables 1 to 4, as far as they ran, as markdown, CSV and LaTeX."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pipeline.base.files import replacing, write_text
from pipeline.base.target import TARGET_AREA
from pipeline.base.template import filled
from pipeline.params.provenance import Change
from pipeline.report.run import paper
from pipeline.report.run.repeated import LEVEL
from pipeline.report.run.report import Report
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


def paper_tables(report: Report) -> str:
    """The chapter; writes table1.csv, table1.tex, ..., those that have rows."""
    params, results, named = report.params, report.results, report.styles
    identified = parameters.identified(results, params)
    tables = {2: (parameters.as_table(identified, named), parameters.records(identified))}
    for count, rows in (
        (1, benchmark.benchmark(results, report.in_physx)),
        (3, benchmark.ablation(results, paper.OPTIMISERS)),
        (4, benchmark.ablation(results, paper.ABLATIONS)),
    ):
        if rows:
            table = benchmark.as_table(rows, params.trials.targets, named)
            tables[count] = table, benchmark.records(rows)
    for count, (table, records) in tables.items():
        path, over = report.folder / "tables" / f"table{count}", (*OVER, len(table[0]) - 1)
        write_csv(path.with_suffix(".csv"), records)
        text = latex(table, CAPTIONS[count], f"tab:{path.name}", None if count == 2 else over)
        write_text(path.with_suffix(".tex"), text)
    repeated = report.repeated
    return filled(
        Path(__file__).with_name("paper_tables.md.j2"),
        tables={n: markdown(table, repeats=False) for n, (table, _) in sorted(tables.items())},
        captions=CAPTIONS,
        paper=benchmark.PAPER,
        sources={row[2] for table, _ in tables.values() for row in table[1]},
        area=TARGET_AREA,
        floors=results.floors,
        in_physx=report.in_physx,
        campaign={n: markdown(campaign.as_table(repeated, n)) for n in campaign.ROWS if repeated},
        level=LEVEL,
        changed=repeated and _listed(repeated.changed_settings(params)),
        trusted=any(result.confidence for result in results),
        edges=any(value.at_edge for row in identified for value in row.values.values()),
    )


def _listed(changed: list[Change]) -> str:
    """Settings of the campaign, and those of this run."""
    return "; ".join(
        str(change).replace(" was ", " ").replace(", is ", ", here ") for change in changed
    )


def write_csv(path: Path, records: pd.DataFrame) -> None:
    """Write a table for machines."""
    with replacing(path) as temporary:
        records.to_csv(temporary, index=False, float_format="%.4g", lineterminator="\n")
