"""The run in one table, a row a band; and what recorded bands are, in another."""

from __future__ import annotations

from collections.abc import Iterator

import pandas as pd

from pipeline.report.results import Results
from pipeline.report.tables.cells import NONE, Table, number, without_empty
from pipeline.report.tables.identified import ranged
from pipeline.report.tables.landings import (
    LAUNCHED,
    LandingErrors,
    coverage,
    intervals,
    landing_errors,
    of_kind,
    prediction_error,
)
from sling2sim2real.drawing.styles import Styles
from sling2sim2real.quantities import QUANTITIES

VALUES = "youngs_modulus", "mooney_share", "relaxation", "damping_product"


def outcome_table(results: Results, references: tuple[str, ...], styles: Styles) -> Table | None:
    """Landing errors of the main method and the paper's, and how the main method predicts.

    Args:
        references: The main method, and the paper's where both ran.

    Returns:
        None where nothing was launched.
    """
    rows = []
    for name, band, trials in _launched(results, references):
        for kind in LAUNCHED:
            floor = results.least.get(band) if kind == "virtual" else None
            some = [of_kind(trial, kind) for trial in trials]
            if some[0].empty:
                continue
            errors = [_errors(result) for result in some] + [None] * (len(references) - len(some))
            parts, ranges = prediction_error(some[0])["all"], intervals(some[0]) or {}
            cells = [number(100 * error.mean, ".1f", "N/A") if error else NONE for error in errors]
            main_mean = errors[0].mean if errors[0] else None
            cells += [number(floor and 100 * floor, ".1f")]
            cells += [number(main_mean and floor and main_mean / floor, ".1f")]
            failed = [str(error.failed) for error in errors if error]
            cells += [" · ".join(failed) or NONE]
            cells += [number(100 * parts.mean, ".1f"), number(100 * parts.bias, "+.1f")]
            rows.append([name, f"{len(some[0])} {kind}", *cells, coverage(ranges.get("all"))])
    names = [styles[method].name for method in references]
    heads = ["band", "launches", *(f"{name} [cm]" for name in names)]
    heads += ["actuation floor [cm]", f"{names[0]} / floor", f"failed: {' · '.join(names)}"]
    heads += ["prediction off by [%]", "bias [%]", "in the 90 % interval"]
    return without_empty((heads, rows)) if rows else None


def _launched(
    results: Results, references: tuple[str, ...]
) -> Iterator[tuple[str, str, list[pd.DataFrame]]]:
    """What a row is called, its band, and trials: of the references, or the first alone."""
    for band, methods in results.methods.items():
        yield band, band, [methods[method].trials for method in references]
        for other in results.others.values():
            if other.band == band:
                yield f"{band}, {other.recording}", band, [other.trials]


def _errors(trials: pd.DataFrame) -> LandingErrors | None:
    """Over all targets; None without one."""
    return landing_errors(trials)["all"] if trials.target.notna().any() else None


def values(results: Results, bands: list[str], method: str) -> Table:
    """What a method identified of some bands, with 90 % intervals where they are known."""
    rows = []
    for band in bands:
        result = results.methods[band][method]
        entries = {name: {"value": value} for name, value in result.theta["theta"].items()}
        for group in ("parameters", "derived"):
            for name, entry in result.confidence.get(group, {}).items():
                entries[name] = entries.get(name, {}) | entry
        rows.append([band, *(ranged(entries.get(n), QUANTITIES[n].factor) for n in VALUES)])
    return without_empty((["band", *(QUANTITIES[name].heading for name in VALUES)], rows))
