"""How many launches hit the paper's bullseye."""

from __future__ import annotations

from pipeline.report.noise import landed
from pipeline.report.results import Results
from pipeline.report.tables.benchmark import band_name, ordered
from pipeline.report.tables.cells import NONE, Table
from pipeline.report.tables.landings import LAUNCHED, of_kind
from sling2sim2real.drawing.styles import Styles

BULLSEYE = 0.20  # m, the target's radius in the paper (III-C)


def bullseye(results: Results, styles: Styles) -> Table | None:
    """How many launches land within BULLSEYE of their target; one that fails is no hit."""
    rows, targets = [], sorted(set(results.trials.target.dropna()))
    for band, methods in results.methods.items():
        for method in ordered(methods):
            for kind in LAUNCHED:
                trials = of_kind(methods[method].trials, kind)
                trials = trials.loc[trials.target.notna()]
                if trials.empty:
                    continue
                hit = landed(trials) & ((trials.landing_y - trials.target).abs() <= BULLSEYE)
                cells = [_share(hit[trials.target == target]) for target in targets]
                all_of_them = f"{_share(hit)} ({100 * hit.mean():.0f} %)"
                rows.append([band_name(band), styles[method].name, kind, *cells, all_of_them])
    heads = ["band", "method", "launches", *(f"g = {100 * g:.1f}" for g in targets), "all targets"]
    return (heads, rows) if rows else None


def _share(hit) -> str:
    return f"{int(hit.sum())} of {len(hit)}" if len(hit) else NONE
