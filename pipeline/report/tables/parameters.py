"""What was identified, in the layout of the paper's table 2, its own numbers below ours."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from pipeline.params import Params
from pipeline.report import paper
from pipeline.report.results import PRINTED, Result, Results
from pipeline.report.tables.benchmark import PAPER, band_name, method_name, ordered
from pipeline.report.tables.cells import NONE, Table, number
from sling2sim2real.drawing.styles import Styles
from sling2sim2real.identification.objective.box import SearchBox
from sling2sim2real.quantities import QUANTITIES
from sling2sim2real.settings.identification import LAWS
from sling2sim2real.simulator.parameters import THETA
from sling2sim2real.simulator.rubber import RUBBER

NAMES = (*THETA, *LAWS[RUBBER])
PRIOR = "prior"
RECORDED = {"rig": "virtual", "recording": "measured"}


@dataclass(frozen=True)
class Value:
    """A parameter: what the search found, and what the posterior says [SI].

    Attributes:
        state: "identified", "not identifiable", "fixed" (the method does not search it), "prior"
            (no value, but what is known without a recording) or "" where no confidence is known.
        low, high: Of the 90 % interval; NaN where there is none.
        at_edge: The search ended at a side of its box.
    """

    value: float
    state: str = ""
    low: float = math.nan
    high: float = math.nan
    at_edge: bool = False


@dataclass(frozen=True)
class IdentifiedRow:
    """Parameters of one method on one band, by name, and the printed loss there."""

    band: str
    method: str
    source: str
    values: dict[str, Value]
    loss: float


def identified(results: Results, params: Params) -> list[IdentifiedRow]:
    """Table 2: every method that ran, the paper's own numbers below those of its methods."""
    rows = []
    for band, ran in results.methods.items():
        for method in ordered(ran):
            result, source = ran[method], RECORDED[params.bands[band].source]
            names = (name for name in NAMES if name in result.theta["theta"])
            values = {name: _value(params, result, name) for name in names}
            rows.append(IdentifiedRow(band, method, source, values, printed_loss(result)))
            if priors := _priors(result):
                rows.append(IdentifiedRow(band, method, PRIOR, priors, math.nan))
            if cells := paper.THETA.get((band, method)):
                *numbers, loss = cells
                theirs = {
                    str(n): Value(number_i) for n, number_i in zip(THETA, numbers, strict=True)
                }
                rows.append(IdentifiedRow(band, method, PAPER, theirs, loss))
    return rows


def printed_loss(result: Result) -> float:
    """The paper's loss of the calibrated simulator, whatever the method minimised."""
    loss = result.theta.get("loss", {})
    return float(sum(loss.get(term, math.nan) for term in PRINTED))


def _value(params: Params, result: Result, name: str) -> Value:
    value = result.theta["theta"][name]
    if name in params.methods[result.method].fixed:
        return Value(value, "fixed")
    box = SearchBox.of_method(params, result.method)
    edge = name in box.names and at_edge(value, name, box)
    entry = result.confidence.get("parameters", {}).get(name)
    if entry is None:
        return Value(value, at_edge=edge)
    state = "identified" if entry["identifiable"] else "not identifiable"
    return Value(value, state, entry["low"], entry["high"], edge)


def _priors(result: Result) -> dict[str, Value]:
    """What a density's method knows of each parameter without the recording."""
    entries = result.confidence.get("parameters", {})
    priors = {name: entry["prior"] for name, entry in entries.items() if entry.get("prior")}
    return {name: Value(math.nan, PRIOR, *ends) for name, ends in priors.items()}


def at_edge(value: float, name: str, box: SearchBox) -> bool:
    """Whether the search ended within 1 % of a side of its box: the optimum may lie outside."""
    axis = box.names.index(name)
    low, high = box.low[axis], box.high[axis]
    if box.log[axis]:
        value, low, high = math.log(value), math.log(low), math.log(high)
    return not 0.01 <= (value - low) / (high - low) <= 0.99


def as_table(rows: list[IdentifiedRow], styles: Styles) -> Table:
    """Parameters with their intervals; bold: the least loss of a band."""
    losses: dict[tuple[str, str], list[float]] = {}
    for row in rows:
        losses.setdefault((row.band, row.source), []).append(row.loss)
    least = {group: np.nanmin([math.inf, *some]) for group, some in losses.items() if len(some) > 1}
    names, lines = _shown(rows), []
    for row in rows:
        cells = [_cell(name, row.values[name]) if name in row.values else NONE for name in names]
        loss = number(row.loss, ".4f")
        loss = f"**{loss}**" if row.loss == least.get((row.band, row.source)) else loss
        whose = band_name(row.band), method_name(row.method, styles), row.source
        lines.append([*whose, *cells, loss])
    heads = [QUANTITIES[name].heading for name in names]
    return ["band", "method", "source", *heads, "loss"], lines


def _shown(rows: list[IdentifiedRow]) -> list[str]:
    """The five, and what a law that any method runs with has beside them."""
    return [name for name in NAMES if name in THETA or any(name in row.values for row in rows)]


def _cell(name: str, value: Value) -> str:
    if value.state == PRIOR:
        return _between(name, value.low, value.high)
    shown = _physical(name, value.value) + (" ⚠" if value.at_edge else "")
    if value.state != "identified":
        return f"{shown}, {value.state}" if value.state else shown
    outside = "" if value.low <= value.value <= value.high else " †"
    return f"{shown}{outside} ({_between(name, value.low, value.high)})"


def _between(name: str, low: float, high: float) -> str:
    """An interval with as few digits as a value, or as many more as tell its ends apart."""
    for digits in (2, 3, 4, 5):
        ends = _physical(name, low, digits), _physical(name, high, digits)
        if ends[0] != ends[1]:
            break
    return " – ".join(ends)


def exactly(name: str, value: float) -> str:
    """A setting as the tables print parameters, with more digits where it has more."""
    texts = [_physical(name, value, digits) for digits in (2, 3, 4, 5)]
    value *= QUANTITIES[name].factor
    return next((text for text in texts if math.isclose(float(text), value)), f"{value:g}")


def _physical(name: str, value: float, digits: int = 2) -> str:
    """Text as in 929, 11.1, 0.46: a digit more with a unit, else so many after the point."""
    quantity = QUANTITIES[name]
    value *= quantity.factor
    if quantity.unit and value:
        digits = max(digits - math.floor(math.log10(abs(value))), 0)
    return f"{value:.{digits}f}"


def records(rows: list[IdentifiedRow]) -> pd.DataFrame:
    """The same for machines: a line a row; empty: not known."""
    lines = []
    for row in rows:
        line: dict[str, str | float | None]
        line = {"band": row.band, "method": row.method, "source": row.source}
        for name in _shown(rows):
            value_of = row.values.get(name, Value(math.nan))
            unit = f"_{QUANTITIES[name].si.lower()}" if QUANTITIES[name].si else ""
            for part, value in (
                ("", value_of.value),
                ("_low", value_of.low),
                ("_high", value_of.high),
            ):
                line[f"{name}{part}{unit}"] = value
            line[f"{name}_state"] = value_of.state or None
        lines.append(line | {"loss": row.loss})
    return pd.DataFrame(lines)
