"""Launches that become evidence: into data/evidence/<band>.csv, each once, and never a score."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from sling2sim2real.base import launch_table as table
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_text
from sling2sim2real.base.layout import Layout
from sling2sim2real.identification.posterior.evidence import COLUMNS, read_launches

Launch = tuple[float, float, float | None, float]  # draw (y, z), its error or None, landing [m]
# What becomes of a launch that equals one which is there; "passed over": as many as there are, so
# that a table may be added again.
Equal = Literal["refused", "passed over", "added"]


def read(path: Path) -> list[Launch]:
    """Launches of a CSV with the columns of data/evidence. Raises UserError."""
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    launches = read_launches(path, error=None)
    if not launches:
        raise UserError(f"{path}: holds no launch; columns are {','.join(COLUMNS)}")
    return [(*launch.draw, launch.error, launch.landing) for launch in launches]


def add(layout: Layout, band: str, launches: Sequence[Launch], equal: Equal = "refused") -> int:
    """Write launches below the band's others; how many there are then.

    Raises:
        UserError: One of them is there already, or is a score; nothing is written.
    """
    rows, new = joined(layout, band, launches, equal)
    if new:
        _write(layout.evidence / f"{band}.csv", rows)
    return len(rows)


def without_last(layout: Layout, band: str) -> tuple[Launch, int]:
    """Take the band's last launch out; it, and how many are left.

    Raises:
        UserError: There is none.
    """
    path = layout.evidence / f"{band}.csv"
    there = table.rows(path, "evidence") if path.is_file() else []
    if not there:
        raise UserError(f"{path}: holds no launch of {band}, so there is none to take back")
    last = read_launches(path, error=None)[-1]
    if rows := [row.cells for row in there[:-1]]:
        _write(path, rows)
    else:
        path.unlink()
    return (*last.draw, last.error, last.landing), len(rows)


def _write(path: Path, rows: Sequence[dict]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def joined(
    layout: Layout, band: str, launches: Sequence[Launch], equal: Equal = "refused"
) -> tuple[list[dict], int]:
    """Rows of the band's table with launches below them, and how many are new. As `add`."""
    path = layout.evidence / f"{band}.csv"
    scores = table.scores(layout, band)
    there = table.rows(path, "evidence") if path.is_file() else []
    stored = [(*row.draw, row.landing) for row in there if row.landing is not None]
    rows: list[dict] = [row.cells for row in there]
    before = len(there)
    for y, z, error, landing in launches:
        launch = (y, z, landing)
        if table.among(launch, scores):
            raise UserError(table.told_twice(launch, path, layout.measured / path.name))
        if equal != "added" and table.among(launch, stored):
            if equal == "refused":
                raise UserError(
                    f"{path}: this launch is there already; if you measured one more that is equal,"
                    " add --again; else `dvc repro` runs what is stale"
                )
            stored.remove(next(other for other in stored if table.among(launch, [other])))
            continue
        values = (y, z, "" if error is None else error, landing)
        rows.append(dict(zip(COLUMNS, values, strict=True)))
    return rows, len(rows) - before
