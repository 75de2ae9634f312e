"""Landing errors in the layout of the paper's tables 1, 3 and 4, its own numbers below ours."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from pipeline.report import paper
from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, number
from pipeline.report.tables.landings import (
    LAUNCHED,
    LandingErrors,
    landing_errors,
    of_kind,
    within,
)
from sling2sim2real.drawing.styles import Styles

PAPER = "paper, real robot"
FLOOR, ORACLE = "actuation floor", "virtual, oracle"
APART = {*paper.OPTIMISERS, *paper.ABLATIONS} - set(paper.BENCHMARK)  # tables 3 and 4 hold these


@dataclass(frozen=True)
class Row:
    """Landing errors of one method on one band, by whom they were found.

    Attributes:
        band: As in params.yaml.
        method: As in params.yaml, or FLOOR.
        source: "virtual", "measured", PAPER or ORACLE.
        errors: By target, and of "all".
    """

    band: str
    method: str
    source: str
    errors: dict[float | str, LandingErrors]


def ordered(methods: Iterable[str]) -> list[str]:
    """Methods of tables 1 and 2 that ran: the paper's, then others, those of APART last."""
    theirs = [method for method in paper.BENCHMARK if method in methods]
    return list(dict.fromkeys([*theirs, *sorted(methods, key=APART.__contains__)]))


def benchmark(results: Results) -> list[Row]:
    """Table 1: every method that stands in no other table, on every band that it launched on."""
    rows = []
    for band, ran in results.methods.items():
        rows += _rows(results, band, (method for method in ordered(ran) if method not in APART))
        if band in results.floors:
            rows.append(Row(band, FLOOR, ORACLE, _floor(results.floors[band])))
    return rows


def ablation(results: Results, methods: tuple[str, ...]) -> list[Row]:
    """Tables 3 and 4: the paper's rows that ran, on bands where one of the ablations did."""
    bands = [band for band, ran in results.methods.items() if APART & {*methods} & {*ran}]
    return [row for band in bands for row in _rows(results, band, methods)]


def _rows(results: Results, band: str, methods: Iterable[str]) -> list[Row]:
    """Rows of the methods that launched on a band, each with the paper's own below it."""
    rows = []
    for method in methods:
        result = results.methods[band].get(method)
        own_rows = [] if result is None else _launched(result.trials)
        rows += [Row(band, method, kind, errors) for kind, errors in own_rows]
        if own_rows and (cells := paper.LANDING.get((band, method))):
            rows.append(Row(band, method, PAPER, _papers(cells)))
    return rows


def _launched(trials: pd.DataFrame) -> list[tuple[str, dict[float | str, LandingErrors]]]:
    by_kind = {kind: landing_errors(of_kind(trials, kind)) for kind in LAUNCHED}
    return [(kind, errors) for kind, errors in by_kind.items() if errors["all"].launches]


def _papers(cells: tuple) -> dict[float | str, LandingErrors]:
    """The paper's cells; its total's ± is what it prints."""
    result = {}
    for key, cell in zip((*paper.TARGETS, "all"), cells, strict=True):
        mean, std = (math.nan, math.nan) if cell is None else (c / 100 for c in cell)
        result[key] = LandingErrors(paper.REPEATS, None, mean, std, within=std)
    launches = paper.REPEATS * len(paper.TARGETS)
    result["all"] = replace(result["all"], launches=launches, std=math.nan)
    return result


def _floor(floor: dict) -> dict[float | str, LandingErrors]:
    """The oracle's launches (rig/oracle/floor.py)."""

    def errors(content: dict) -> LandingErrors:
        numbers = (content.get(name) for name in ("mean_error_m", "std_m", "bias_m"))
        mean, std, bias = (math.nan if value is None else value for value in numbers)
        return LandingErrors(content["launches"], content.get("failed", 0), mean, std, std, bias)

    result = {float(g): errors(content) for g, content in floor["targets"].items()}
    return {**result, "all": replace(errors(floor), within=within(result.values()))}


def as_table(rows: list[Row], targets: Iterable[float], styles: Styles) -> Table:
    """Mean ± deviation in cm; bold: the lowest of a band where no launch failed."""
    tried = {key for row in rows for key in row.errors if key != "all"}
    papers = paper.TARGETS if any(row.source == PAPER for row in rows) else ()
    keys = [*sorted({*targets, *papers, *tried}), "all"]
    lowest = {key: _lowest(rows, key) for key in keys}
    lines = []
    for row in rows:
        cells = []
        for key in keys:
            errors = row.errors.get(key)
            least = lowest[key].get((row.band, row.source))
            bold = "**" if errors and not errors.failed and errors.mean == least else ""
            cells.append(bold + spread(errors) + bold)
        total = row.errors["all"]
        failed = NONE if total.failed is None else f"{total.failed} of {total.launches}"
        names = band_name(row.band), method_name(row.method, styles), row.source
        lines.append([*names, *cells, number(100 * total.std, ".2f"), failed])
    heads = [f"g = {100 * key:.1f}" for key in keys[:-1]]
    return ["band", "method", "source", *heads, "all targets", "± over all", "failed"], lines


def _lowest(rows: list[Row], key: float | str) -> dict[tuple[str, str], float]:
    """The lowest mean of each band and kind of which two methods or more have no failures."""
    means: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        errors = row.errors.get(key)
        if errors and not errors.failed and np.isfinite(errors.mean):
            means.setdefault((row.band, row.source), []).append(errors.mean)
    return {group: min(some) for group, some in means.items() if len(some) > 1}


def spread(errors: LandingErrors | None) -> str:
    """Mean ± deviation [cm]; N/A where no launch counts; partial failures are counted."""
    if errors is None:
        return NONE
    if not np.isfinite(errors.mean):
        return "N/A"
    around = number(100 * errors.within, ".2f", "")
    failed = f", {errors.failed} failed" if errors.failed else ""
    return f"{100 * errors.mean:.2f}{' ± ' * bool(around)}{around}{failed}"


def band_name(band: str) -> str:
    """Name that the paper gives the band that ours imitates, or its own name."""
    return paper.BANDS.get(band, band)


def method_name(method: str, styles: Styles) -> str:
    """Name of a method for readers."""
    return method if method == FLOOR else styles[method].name


def records(rows: list[Row]) -> pd.DataFrame:
    """The same for machines: a line a cell, for every target that was tried; empty: not known."""
    lines = (
        {
            "band": row.band,
            "method": row.method,
            "source": row.source,
            "target_m": key,
            "launches": errors.launches,
            "failed": errors.failed,
            "mean_error_cm": number(100 * errors.mean, ".4g", "N/A"),
            "std_cm": 100 * errors.std,
            "std_within_targets_cm": 100 * errors.within,
            "bias_cm": 100 * errors.bias,
        }
        for row in rows
        for key, errors in row.errors.items()
    )
    return pd.DataFrame(lines).astype({"failed": "Int64"})
