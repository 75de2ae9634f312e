"""Tables of launches that a user measured, a CSV a band: as scores, or as evidence.

A launch is one or the other: what has taught the parameters proves nothing of them.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Sequence
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.base.layout import Layout

DRAW = ("draw_y_m", "draw_z_m")
LANDING = "landing_y_m"
LIMITS = {  # m, and what lies on that side of the fork
    "draw_y_m": (-20, 0, "behind the fork"),
    "draw_z_m": (-20, 20, "above the tips"),
    LANDING: (0, 20, "beyond the fork; leave it empty where it did not land"),
}
SAME = 1e-6  # m
Launch = tuple[float, float, float]  # draw (y, z), landing [m]


def file_of(folder: Path, band: str, bands: Collection[str]) -> Path | None:
    """The band's CSV in `folder`; None where there is none.

    Args:
        bands: Of params.yaml.

    Raises:
        UserError: There is a CSV of no band, which nobody would ever read.
    """
    files = [f"{one}.csv" for one in bands]
    for path in sorted(folder.glob("[!.]*")):
        if path.suffix.lower() == ".csv" and path.name not in files:
            raise UserError(
                f"{path}: no band of params.yaml goes by that name; call it {' or '.join(files)}"
            )
    path = folder / f"{band}.csv"
    return path if path.is_file() else None


def rows(
    path: Path, required: Sequence[str], optional: Sequence[str]
) -> list[tuple[int, dict[str, str]]]:
    """Number of each line that is not empty, and its cells by column. Raises UserError."""
    known = (*required, *optional)
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
        *(f"unknown column {name!r}" for name in names if name not in known),
        *(f"two columns {name}" for name in known if names.count(name) > 1),
    ]
    if problems:
        raise UserError(f"{path}: {problems[0]}; columns are {','.join(known)}")
    found = []
    for line, cells in lines:
        if None in cells:
            raise UserError(f"{path}, line {line}: more cells than the {len(names)} columns")
        row = {name: (cells.get(name) or "").strip() for name in known}
        if any(row.values()):
            found.append((line, row))
    return found


def metres(where: str, name: str, text: str, limits: dict = LIMITS) -> float | None:
    """A cell within its column's limits, both left out; None where it is empty.

    Raises UserError, which begins with `where`.
    """
    if not text:
        return None
    value = number(where, name, text)
    low, high, side = limits[name]
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


def drawn(where: str, row: dict[str, str]) -> tuple[float, float]:
    """The draw of a row. Raises UserError."""
    y, z = (metres(where, name, row[name]) for name in DRAW)
    if y is None or z is None:
        raise UserError(f"{where}: a draw needs draw_y_m and draw_z_m")
    return y, z


def among(launch: Launch, launches: Collection[Launch]) -> bool:
    """Whether a launch is one of `launches`: draw and landing alike."""
    return any(math.dist(launch, one) < SAME for one in launches)


def landed(path: Path, required: Sequence[str], optional: Sequence[str]) -> list[Launch]:
    """Draws and landings of a CSV, but of launches that did not land. Raises UserError."""
    found = []
    for line, row in rows(path, required, optional):
        where = f"{path}, line {line}"
        landing = metres(where, LANDING, row[LANDING])
        if landing is not None:
            found.append((*drawn(where, row), landing))
    return found


SCORES = (*DRAW, LANDING), ("target_m", "method")  # columns that must be there, that may be
EVIDENCE = (*DRAW, LANDING), ("draw_error_m",)


def scores(layout: Layout, band: str) -> list[Launch]:
    """Launches that score the band's predictions. Raises UserError."""
    path = layout.measured / f"{band}.csv"
    return landed(path, *SCORES) if path.is_file() else []


def expect_apart(layout: Layout, band: str) -> None:
    """Raises UserError where a launch of the band is both evidence and a score.

    Whatever uses either asks: neither needs to run anew because the other has changed.
    """
    path = layout.evidence / f"{band}.csv"
    known = scores(layout, band)
    if not (known and path.is_file()):
        return
    for launch in landed(path, *EVIDENCE):
        if among(launch, known):
            raise UserError(told_twice(launch, path, layout.measured / path.name))


def told_twice(launch: Launch, evidence: Path, score: Path) -> str:
    """Why a launch cannot be both."""
    y, z, landing = launch
    return (
        f"{evidence}: the launch from {y:g}, {z:g} to {landing:g} m stands in {score} too;"
        " it is evidence or a score, never both"
    )
