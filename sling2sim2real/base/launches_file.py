"""Measured launches of a band: launches.csv, a row each.

    draw_y,draw_z,error,landing,use
    -0.30,-0.15,,1.40,fit

Metres, frame O. `error` is the standard deviation of the draw along each axis; empty: that of a
commanded one. `use`: a launch to `fit` (or empty) is evidence; one to `check` never enters θ and is
held against what is predicted of it. Only a launch to check may have no landing: it did not land.
An experiment has columns `target` and `method` too: what a launch to check was aimed at, and by
whose policy.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_text
from sling2sim2real.base.target import TARGET_AREA

COLUMNS = ("draw_y", "draw_z", "error", "landing", "use")
MORE = ("target", "method")
FIT, CHECK = USES = "fit", "check"
LIMITS = {  # m, both left out, and what lies between
    "draw_y": (-20, 0, "behind the fork"),
    "draw_z": (-20, 20, "below or above the tips"),
    "error": (0, 0.1, "0 is exact"),
    "landing": (0, 20, "beyond the fork"),
    "target": (*TARGET_AREA, "the target on the floor, outside of which landings count as failed"),
}
SAME = 1e-6  # m


@dataclass(frozen=True)
class LaunchRow:
    """One measured launch.

    Attributes:
        draw: (y, z) [m].
        error: Standard deviation of the draw along each axis [m]; None: of a commanded one.
        landing: [m]; None: it did not land.
        use: FIT or CHECK.
        target: That it was aimed at [m], to check how near it came.
        method: Whose policy aimed it; "" of a launch that every method predicts.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float | None
    use: str = FIT
    target: float | None = None
    method: str = ""

    def equals(self, other: LaunchRow) -> bool:
        """Whether draw and landing are alike."""
        here, there = ((*row.draw, math.inf if row.landing is None else row.landing)
                       for row in (self, other))  # fmt: skip
        return all(a == b or abs(a - b) < SAME for a, b in zip(here, there, strict=True))


def read_launches(path: Path) -> list[LaunchRow]:
    """Read the launches, oldest first; none where there is no file.

    Raises:
        UserError: It cannot be read, or a row says what no launch can have done.
    """
    if not path.is_file():
        return []
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            names = reader.fieldnames = [name.strip() for name in reader.fieldnames or []]
            lines = [(reader.line_num, cells) for cells in reader]
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text, save it as CSV (UTF-8)") from error
    except (OSError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read as CSV ({error})") from error
    needed = ("draw_y", "draw_z", "landing")
    problems = [f"lacks the column {name}" for name in needed if name not in names]
    problems += [f"unknown column {name!r}" for name in names if name not in (*COLUMNS, *MORE)]
    problems += [f"two columns {name}" for name in (*COLUMNS, *MORE) if names.count(name) > 1]
    if problems:
        raise UserError(f"{path}: {problems[0]}; columns are {','.join((*COLUMNS, *MORE))}")
    rows = []
    for line, cells in lines:
        where = f"{path}, line {line}"
        if None in cells:
            raise UserError(f"{where}: more cells than the {len(names)} columns")
        row = {name: (cells.get(name) or "").strip() for name in (*COLUMNS, *MORE)}
        if any(row.values()):
            rows.append(_row(where, row))
    return rows


def write_launches(path: Path, rows: Sequence[LaunchRow]) -> None:
    """Write them all; whole or not at all."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    more = any(row.method for row in rows)
    writer.writerow((*COLUMNS, *MORE) if more else COLUMNS)
    for row in rows:
        cells = (*row.draw, row.error, row.landing, row.use)
        cells += (row.target, row.method) if more else ()
        writer.writerow("" if cell is None else cell for cell in cells)
    write_text(path, text.getvalue())


def _row(where: str, cells: dict[str, str]) -> LaunchRow:
    use = cells["use"] or FIT
    if use not in USES:
        raise UserError(f"{where}: use must be {' or '.join(USES)}, got {use!r}")
    y, z, error, landing = (metres(where, name, cells[name]) for name in COLUMNS[:4])
    if y is None or z is None:
        raise UserError(f"{where}: a launch needs draw_y and draw_z")
    if landing is None and use == FIT:
        raise UserError(f"{where}: a launch that did not land is no evidence: make its use check")
    method = cells["method"]
    if method and use == FIT:
        raise UserError(f"{where}: a launch that a policy aimed is to check: make its use check")
    target = metres(where, "target", cells["target"]) if method else None  # else nobody aimed it
    return LaunchRow((y, z), error, landing, use, target, method)


def metres(where: str, name: str, text: str) -> float | None:
    """A cell of a column of lengths; None where it is empty. Raises UserError: `where` and why."""
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    low, high, what = LIMITS[name]
    if not (low < value < high or (name in ("error", "target") and value in (low, high))):
        raise UserError(f"{where}: {name} must lie from {low} to {high} m ({what}), got {text}")
    return value
