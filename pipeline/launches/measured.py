"""Launches that a user measured: data/trials/measured/<band>.csv (format: README.md beside it)."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from pipeline.base.errors import UserError
from pipeline.base.target import TARGET_AREA

REQUIRED = ("draw_y_m", "draw_z_m", "landing_y_m")
OPTIONAL = ("target_m", "method")
LIMITS = {  # m, and what lies on that side of the fork
    "draw_y_m": (-20, 0, "behind the fork"),
    "draw_z_m": (-20, 20, "above the tips"),
    "landing_y_m": (0, 20, "beyond the fork; leave it empty where it did not land"),
    "target_m": (0, 20, "beyond the fork"),
}


@dataclass(frozen=True)
class Measured:
    """One launch: draw (y, z) [m], landing [m] (None: it did not land), target [m] if aimed."""

    draw: tuple[float, float]
    landing: float | None
    target: float | None


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


def named(path: Path) -> Counter[str]:
    """How many launches of a measured CSV name each method; "" stands for none.

    Raises:
        UserError: The file cannot be read.
    """
    return Counter(row["method"] for _, row in _rows(path))


def read_measured(path: Path, method: str, known: Collection[str]) -> list[Measured]:
    """Measured launches of a CSV: those of `method`, and those that name no method.

    Nobody aimed a launch without a method, so its target, if any, is left out: such launches are
    held against predictions alone.

    Args:
        known: Methods of params.yaml; a row that names another is refused.

    Raises:
        UserError: The file cannot be read, or a row says what no launch can have done.
    """
    launches = []
    for line, row in _rows(path):
        where = f"{path}, line {line}"
        if row["method"] and row["method"] not in known:
            raise UserError(
                f"{where}: method {row['method']!r} is not in params.yaml, which has"
                f" {', '.join(known)}; leave it empty for a launch that no policy aimed"
            )
        y, z, landing, target = (_metres(where, name, row[name]) for name in LIMITS)
        if y is None or z is None:
            raise UserError(f"{where}: a draw needs draw_y_m and draw_z_m")
        target = target if row["method"] else None
        if target is not None and not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
            raise UserError(
                f"{where}: target_m {target} lies outside the target on the floor,"
                f" {list(TARGET_AREA)}, where every landing counts as failed"
            )
        if row["method"] in ("", method):
            launches.append(Measured((y, z), landing, target))
    return launches


def _rows(path: Path) -> list[tuple[int, dict[str, str]]]:
    """Number of each line that is not empty, and its cells by column."""
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
        *(f"lacks the column {name}" for name in REQUIRED if name not in names),
        *(f"unknown column {name!r}" for name in names if name not in REQUIRED + OPTIONAL),
        *(f"two columns {name}" for name in REQUIRED + OPTIONAL if names.count(name) > 1),
    ]
    if problems:
        raise UserError(f"{path}: {problems[0]}; columns are {','.join(REQUIRED + OPTIONAL)}")
    rows = []
    for line, cells in lines:
        if None in cells:
            raise UserError(f"{path}, line {line}: more cells than the {len(names)} columns")
        row = {name: (cells.get(name) or "").strip() for name in REQUIRED + OPTIONAL}
        if any(row.values()):
            rows.append((line, row))
    return rows


def _metres(where: str, name: str, text: str) -> float | None:
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f"{where}: {name} must be a number of metres, got {text!r}")
    low, high, side = LIMITS[name]
    if not low < value < high:
        raise UserError(f"{where}: {name} must lie between {low} and {high} m ({side}), got {text}")
    return value
