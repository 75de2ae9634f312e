"""Measured launches of a band: launches.csv, a row each.

    draw_y,draw_z,error,landing,use
    -0.30,-0.15,,1.40,fit

Metres, frame O. `error` is the standard deviation of the draw along each axis; empty: that of a
commanded one. `use`: a launch to `fit` (or empty) is evidence; one to `check` never enters θ and is
held against what is predicted of it. Columns `speed` [m/s] and `angle` [degrees above the horizon]
say how the projectile left the pouch, where somebody measured it; a launch to fit has a landing or
a speed. One to check without a landing did not land. An experiment has columns `target` and
`method` too: what a launch to check was aimed at, and by whose policy.
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
LEFT, AIMED = ("speed", "angle"), ("target", "method")
MORE = (*LEFT, *AIMED)
FIT, CHECK = USES = "fit", "check"
UNITS = {"speed": "m/s", "angle": "degrees"}  # of all else: m
LIMITS = {  # both left out, and what lies between
    "draw_y": (-20, 0, "behind the fork"),
    "draw_z": (-20, 20, "below or above the tips"),
    "error": (0, 0.1, "0 is exact"),
    "landing": (0, 20, "beyond the fork"),
    "speed": (0, 100, "as it leaves the pouch"),
    "angle": (-90, 90, "above the horizon"),
    "target": (*TARGET_AREA, "the target on the floor, outside of which landings count as failed"),
}
SAME = 1e-6  # m


@dataclass(frozen=True)
class LaunchRow:
    """One measured launch.

    Attributes:
        draw: (y, z) [m].
        error: Standard deviation of the draw along each axis [m]; None: of a commanded one.
        landing: [m]; None: it did not land, or nobody measured where.
        use: FIT or CHECK.
        target: That it was aimed at [m], to check how near it came.
        method: Whose policy aimed it; "" of a launch that every method predicts.
        speed, angle: As it left the pouch [m/s, degrees above the horizon]; None: not measured.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float | None
    use: str = FIT
    target: float | None = None
    method: str = ""
    speed: float | None = None
    angle: float | None = None

    @property
    def measured(self) -> tuple[float | None, float | None, float | None]:
        """Landing, speed and angle."""
        return self.landing, self.speed, self.angle

    def equals(self, other: LaunchRow) -> bool:
        """Whether the draw and all that was measured are alike."""
        here, there = (
            [math.inf if value is None else value for value in (*row.draw, *row.measured)]
            for row in (self, other)
        )
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
    names = COLUMNS
    names += LEFT if any(row.speed or row.angle is not None for row in rows) else ()
    names += AIMED if any(row.method for row in rows) else ()
    writer.writerow(names)
    for row in rows:
        cells = vars(row) | dict(zip(COLUMNS[:2], row.draw, strict=True))
        writer.writerow("" if cells[name] is None else cells[name] for name in names)
    write_text(path, text.getvalue())


def _row(where: str, cells: dict[str, str]) -> LaunchRow:
    use = cells["use"] or FIT
    if use not in USES:
        raise UserError(f"{where}: use must be {' or '.join(USES)}, got {use!r}")
    names = (*COLUMNS[:4], *LEFT)
    y, z, error, landing, speed, angle = (number(where, name, cells[name]) for name in names)
    if y is None or z is None:
        raise UserError(f"{where}: a launch needs draw_y and draw_z")
    if landing is None and speed is None and use == FIT:
        raise UserError(
            f"{where}: a launch that did not land, without a speed, is no evidence: make its use"
            " check"
        )
    method = cells["method"]
    if method and use == FIT:
        raise UserError(f"{where}: a launch that a policy aimed is to check: make its use check")
    target = number(where, "target", cells["target"]) if method else None  # else nobody aimed it
    return LaunchRow((y, z), error, landing, use, target, method, speed, angle)


def number(where: str, name: str, text: str) -> float | None:
    """A cell of a column of numbers; None where it is empty. Raises UserError: `where` and why."""
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    low, high, what = LIMITS[name]
    if not (low < value < high or (name in ("error", "target") and value in (low, high))):
        unit = UNITS.get(name, "m")
        raise UserError(
            f"{where}: {name} must lie from {low} to {high} {unit} ({what}), got {text}"
        )
    return value
