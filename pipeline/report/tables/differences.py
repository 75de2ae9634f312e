"""Which landing errors differ by more than noise."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pandas as pd

from pipeline.report.noise import Difference, difference
from pipeline.report.results import Results
from pipeline.report.tables.benchmark import band_name
from pipeline.report.tables.cells import NONE, Table
from pipeline.report.tables.landings import LAUNCHED, of_kind
from sling2sim2real.drawing.styles import Styles


class Compared(NamedTuple):
    """Differences by which a method's launches of a kind miss more than those of each reference."""

    band: str
    method: str
    kind: str
    beside: dict[str, Difference | None]


def compared(results: Results, references: Iterable[str], seed: int) -> list[Compared]:
    """Every method beside those of the references that ran on the same band."""
    rows = []
    for band, of_band in results.methods.items():
        for kind in LAUNCHED:
            some = {method: of_kind(result.trials, kind) for method, result in of_band.items()}
            aimed = {
                method: trials_of.loc[trials_of.target.notna()]
                for method, trials_of in some.items()
            }
            for method, trials in aimed.items():
                others = [m for m in references if m != method and len(aimed.get(m, ()))]
                differences = {other: difference(aimed[other], trials, seed) for other in others}
                if differences and len(trials):
                    rows.append(Compared(band, method, kind, differences))
    return rows


def as_table(rows: list[Compared], styles: Styles) -> Table:
    """Differences in cm with their intervals; bold where the interval leaves out zero."""
    beside = [m for m in styles if any(m in row.beside for row in rows)]
    lines = []
    for band, method, kind, differences in rows:
        cells = (shown(differences[other]) if other in differences else NONE for other in beside)
        lines.append([band_name(band), styles[method].name, kind, *cells])
    return ["band", "method", "launches", *(f"beside {styles[m].name}" for m in beside)], lines


def shown(against: Difference | None) -> str:
    """Write a difference as in "+3.20 (+2.10 to +4.40)"."""
    if against is None:
        return "N/A"
    text = _signed(against.mean)
    if np.isfinite(against.low):
        text += f" ({_signed(against.low)} to {_signed(against.high)})"
    text = f"**{text}**" if against.real else text
    return text + (f", {against.left_out} left out" if against.left_out else "")


def _signed(metres: float) -> str:
    return f"{100 * metres:+.2f}".replace("-", "−")


def records(rows: list[Compared]) -> pd.DataFrame:
    """Differences for machines."""
    return pd.DataFrame(
        {
            "band": band,
            "method": method,
            "source": kind,
            "beside": reference,
            "difference_cm": 100 * against.mean,
            "low_95_cm": 100 * against.low,
            "high_95_cm": 100 * against.high,
            "launches": against.launches[1],
            "launches_beside": against.launches[0],
            "failed_share": against.failed[1],
            "failed_share_beside": against.failed[0],
            "left_out": against.left_out,
        }
        for band, method, kind, differences in rows
        for reference, against in differences.items()
        if against is not None
    )
