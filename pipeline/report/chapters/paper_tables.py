"""The paper's tables 1 to 4, as far as they ran, as Markdown and CSV."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from pipeline.report import paper
from pipeline.report.report import Report
from pipeline.report.tables import benchmark, parameters
from pipeline.report.tables.cells import markdown
from sling2sim2real.base.files import replacing
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.base.template import filled

CAPTIONS = {
    1: "Landing error [cm] by band and method: mean ± deviation of |landing − target|; g in cm.",
    2: "Identified parameters, and the paper's loss of each calibrated simulator.",
    3: "Ablation of the optimiser: landing error [cm] as in table 1.",
    4: "Ablation of covariance (c), several starts (m) and the work term: landing error [cm] as"
    " in table 1.",
}


def paper_tables(report: Report) -> str:
    """The chapter; writes table1.csv, table2.csv, ..., those that have rows."""
    params, results, named = report.params, report.results, report.styles
    identified = parameters.identified(results, params)
    tables = {2: (parameters.as_table(identified, named), parameters.records(identified))}
    for count, rows in (
        (1, benchmark.benchmark(results)),
        (3, benchmark.ablation(results, paper.OPTIMISERS)),
        (4, benchmark.ablation(results, paper.ABLATIONS)),
    ):
        if rows:
            table = benchmark.as_table(rows, params.trials.targets, named)
            tables[count] = table, benchmark.records(rows)
    for count, (_, records) in tables.items():
        write_csv(report.folder / "tables" / f"table{count}.csv", records)
    return filled(
        Path(__file__).with_name("paper_tables.md.j2"),
        tables={n: markdown(table, repeats=False) for n, (table, _) in sorted(tables.items())},
        captions=CAPTIONS,
        paper=benchmark.PAPER,
        sources={row[2] for table, _ in tables.values() for row in table[1]},
        area=TARGET_AREA,
        floors=results.floors,
        trusted=any(result.confidence for result in results),
        edges=any(value.at_edge for row in identified for value in row.values.values()),
    )


def write_csv(path: Path, records: pd.DataFrame) -> None:
    """Write a table for machines."""
    with replacing(path) as temporary:
        records.to_csv(temporary, index=False, float_format="%.4g", lineterminator="\n")
