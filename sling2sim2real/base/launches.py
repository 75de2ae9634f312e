"""launches.csv: launches that were measured of a band, a row each; to fit, or to check.

Columns draw_y, draw_z, error, landing, use; of launches that a policy aimed also target, method.
Lengths are in metres, in frame O. A launch is used once: what has taught the parameters proves
nothing of them.
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from sling2sim2real.base.errors import UserError
from sling2sim2real.base.layout import NotMade
from sling2sim2real.base.target import TARGET_AREA

COLUMNS = ("draw_y", "draw_z", "error", "landing", "use")
MORE = ("target", "method")
FIT, CHECK = "fit", "check"
LIMITS = {  # m, both left out, and what lies on that side of the fork
    "draw_y": (-20, 0, "behind the fork"),
    "draw_z": (-20, 20, "above the tips"),
    "error": (-1e-9, 0.1, "the standard deviation of the draw"),
    "landing": (0, 20, "beyond the fork; empty where it did not land"),
    "target": (0, 20, "beyond the fork"),
}


@dataclass(frozen=True)
class MeasuredLaunch:
    """One launch.

    Attributes:
        draw: (y, z) [m].
        error: Standard deviation of the draw along each axis [m]; None: as a commanded one's.
        landing: [m]; None: it did not land.
        use: FIT or CHECK.
        target: [m], of a launch that a policy aimed.
        method: Whose policy; "" of a launch that nobody aimed, which every method predicts.
    """

    draw: tuple[float, float]
    error: float | None
    landing: float | None
    use: str
    target: float | None = None
    method: str = ""


def read_launches(path: Path) -> list[MeasuredLaunch]:
    """The launches of a CSV, oldest first.

    Raises:
        NotMade: There is no such file.
        UserError: It cannot be read, or a row says what no launch can have done.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            names = [name.strip() for name in reader.fieldnames or []]
            reader.fieldnames = names
            rows = [(reader.line_num, row) for row in reader]
    except FileNotFoundError as error:
        raise NotMade(path) from error
    except (OSError, csv.Error, UnicodeDecodeError) as error:
        raise UserError(f"{path}: cannot be read as CSV in UTF-8 ({error})") from error
    lacking = [name for name in COLUMNS if name not in names]
    unknown = [name for name in names if name not in (*COLUMNS, *MORE)]
    if lacking or unknown or len({*names}) < len(names):
        raise UserError(
            f"{path}: its columns must be {', '.join(COLUMNS)}, and may be {', '.join(MORE)};"
            f" it has {', '.join(names) or 'none'}"
        )
    launches: dict[tuple, str] = {}
    result = []
    for line, cells in rows:
        launch = _launch(f"{path}, line {line}", cells)
        same = launches.setdefault((*launch.draw, launch.landing), launch.use)
        if same != launch.use:
            raise UserError(f"{path}, line {line}: a launch is to fit or to check, never both")
        result.append(launch)
    return result


def _launch(where: str, cells: dict) -> MeasuredLaunch:
    if None in cells or None in cells.values():
        raise UserError(f"{where}: must have a cell for each column")
    text = {name: cell.strip() for name, cell in cells.items()}
    y, z, error, landing, target = (_metres(where, name, text.get(name, "")) for name in LIMITS)
    use, method = text["use"], text.get("method", "")
    if y is None or z is None:
        raise UserError(f"{where}: a draw needs draw_y and draw_z")
    if use not in (FIT, CHECK):
        raise UserError(f"{where}: use must be {FIT} or {CHECK}, got {use!r}")
    if use == FIT and (landing is None or method):
        why = "a policy aimed it" if method else "it did not land"
        raise UserError(f"{where}: {why}, so use must be {CHECK}")
    if not method:
        target = None  # nobody aimed it
    if target is not None and not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
        raise UserError(
            f"{where}: target {target} lies outside the target on the floor, {list(TARGET_AREA)},"
            " where every landing counts as failed"
        )
    return MeasuredLaunch((y, z), error, landing, use, target, method)


def _metres(where: str, name: str, text: str) -> float | None:
    """A cell; None where it is empty. Raises UserError."""
    if not text:
        return None
    low, high, meaning = LIMITS[name]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not low < value < high:
        raise UserError(
            f"{where}: {name} must be a number of metres from {low:g} to {high:g} ({meaning}),"
            f" got {text!r}"
        )
    return value
