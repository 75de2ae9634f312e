"""The table of a committed campaign: one JSON of reports/validation, many recordings a band."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from pipeline.report.tables.benchmark import band_name
from pipeline.report.tables.cells import Table, number
from sling2sim2real.base.errors import UserError
from sling2sim2real.drawing.styles import styles

ABLATIONS = Path("reports", "validation", "ablations.json")  # validation/campaigns/ablations.py
METHODS = ("posterior", "paper", "package_si", "real2sim2real")
ALL = "all"  # the bands together


def campaign_table(path: Path, methods: Iterable[str] = METHODS) -> Table | None:
    """Mean distance from the target [cm] by method and band, with its 95 % interval.

    None where there is no such file. Raises UserError where it is no campaign's.
    """
    if not path.exists():
        return None
    try:
        figures = json.loads(path.read_text(encoding="utf-8"))["figures"]
        bands = [*sorted(band for band in figures if band != ALL), ALL]
        ran = [method for method in methods if method in figures[ALL]["methods"]]
        misses = [[figures[band]["methods"][m]["miss_cm"] for band in bands] for m in ran]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UserError(f"{path}: is no campaign's ({error!r}); `git checkout` it") from error
    heads = ["method", *(band if band == ALL else band_name(band) for band in bands)]
    named = styles(ran)
    return heads, [
        [named[method].name, *map(_cell, of_bands)]
        for method, of_bands in zip(ran, misses, strict=True)
    ]


def _cell(miss: dict) -> str:
    low, mean, high = (number(miss[name], ".1f") for name in ("low", "mean", "high"))
    return f"{mean} ({low} to {high})"
