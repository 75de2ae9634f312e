"""Tables of launches that a user measured, a CSV a band: as scores, or as evidence.

A launch is one or the other: what has taught the parameters proves nothing of them.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import Layout

DRAW = ("draw_y_m", "draw_z_m")
LANDING, TARGET = "landing_y_m", "target_m"
LIMITS = {  # m, and what lies on that side of the fork
    "draw_y_m": (-20, 0, "behind the fork"),
    "draw_z_m": (-20, 20, "above the tips"),
    LANDING: (0, 20, "beyond the fork; leave it empty where it did not land"),
    TARGET: (0, 20, "beyond the fork"),
}
MORE = {"scores": (TARGET, "method"), "evidence": ("draw_error_m",)}  # columns that may be there
SAME = 1e-6  # m
Launch = tuple[float, float, float]  # draw (y, z), landing [m]


@dataclass(frozen=True)
class LaunchRow:
    """One row of such a table.

    Attributes:
        where: File and line, for messages.
        cells: By column, "" where empty.
        draw: (y, z) [m].
        landing: [m]; None: it did not land.
    """

    where: str
    cells: dict[str, str]
    draw: tuple[float, float]
    landing: float | None


def file_of(folder: Path, band: str, bands: Collection[str]) -> Path | None:
    """The band's CSV in `folder`; None where there is none.

    Args:
        bands: Of params.yaml.

    Raises:
        UserError: There is a CSV of no band, which nobody would ever read.
    """
    files = [f"{name}.csv" for name in bands]
    for path in sorted(folder.glob("[!.]*")):
        if path.suffix.lower() == ".csv" and path.name not in files:
            raise UserError(
                f"{path}: no band of params.yaml goes by that name; call it {' or '.join(files)}"
            )
    path = folder / f"{band}.csv"
    return path if path.is_file() else None


def rows(path: Path, kind: str) -> list[LaunchRow]:
    """Lines that are not empty, of a CSV of scores or of evidence. Raises UserError."""
    required = (*DRAW, LANDING)
    columns = (*required, *MORE[kind])
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file)
            names = [name.strip() for name in reader.fieldnames or []]
            reader.fieldnames = names
            lines = [(reader.line_num, cells) for cells in reader]
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not UTF-8 text, save it as CSV (UTF-8)") from error
    except (OSError, csv.Error) as error:
        raise UserError(f"{path}: cannot be read as CSV ({error})") from error
    problems = [
        *(f"lacks the column {name}" for name in required if name not in names),
        *(f"unknown column {name!r}" for name in names if name not in columns),
        *(f"two columns {name}" for name in columns if names.count(name) > 1),
    ]
    if problems:
        raise UserError(f"{path}: {problems[0]}; columns are {','.join(columns)}")
    result = []
    for line, cells in lines:
        if None in cells:
            raise UserError(f"{path}, line {line}: more cells than the {len(names)} columns")
        row = {name: (cells.get(name) or "").strip() for name in columns}
        if any(row.values()):
            where = f"{path}, line {line}"
            y, z, landing = (metres(where, name, row[name]) for name in required)
            if y is None or z is None:
                raise UserError(f"{where}: a draw needs draw_y_m and draw_z_m")
            result.append(LaunchRow(where, row, (y, z), landing))
    return result


def metres(where: str, name: str, text: str) -> float | None:
    """A cell within its column's limits, both left out; None where it is empty.

    Raises UserError, which begins with `where`.
    """
    if not text:
        return None
    value = number(where, name, text)
    low, high, side = LIMITS[name]
    if not low < value < high:
        raise UserError(f"{where}: {name} must lie between {low} and {high} m ({side}), got {text}")
    return value


def number(where: str, name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{where}: {name} must be a number of metres, got {text!r}")
    return value


def among(launch: Launch, launches: Collection[Launch]) -> bool:
    """Whether a launch is one of `launches`: draw and landing alike."""
    return any(math.dist(launch, other) < SAME for other in launches)


def landed(path: Path, kind: str) -> list[Launch]:
    """Launches of a CSV, but those that did not land. Raises UserError."""
    return [(*row.draw, row.landing) for row in rows(path, kind) if row.landing is not None]


def scores(layout: Layout, band: str) -> list[Launch]:
    """Launches that score the band's predictions. Raises UserError."""
    path = layout.measured / f"{band}.csv"
    return landed(path, "scores") if path.is_file() else []


def expect_apart(layout: Layout, band: str) -> None:
    """Raises UserError where a launch of the band is both evidence and a score.

    Whatever uses either asks: neither needs to run anew because the other has changed.
    """
    path = layout.evidence / f"{band}.csv"
    scored = scores(layout, band)
    if not (scored and path.is_file()):
        return
    for launch in landed(path, "evidence"):
        if among(launch, scored):
            raise UserError(told_twice(launch, path, layout.measured / path.name))


def told_twice(launch: Launch, evidence: Path, score: Path) -> str:
    """Why a launch cannot be both."""
    y, z, landing = launch
    return (
        f"{evidence}: the launch from {y:g}, {z:g} to {landing:g} m stands in {score} too;"
        " it is evidence or a score, never both"
    )
