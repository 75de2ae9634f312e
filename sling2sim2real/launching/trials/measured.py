"""Launches that a user measured: data/trials/measured/<band>.csv (format: README.md beside it).

The stage `evidence` checks them, and whatever predicts them reads what it writes.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Annotated

from sling2sim2real.base import launch_table as table
from sling2sim2real.base.errors import UserError
from sling2sim2real.base.files import write_json
from sling2sim2real.base.schema import LIST, JsonRecord, read_json
from sling2sim2real.base.target import TARGET_AREA
from sling2sim2real.settings import Settings


class Measured(JsonRecord):
    """One launch that a user measured.

    Attributes:
        draw: (y, z) [m].
        landing: [m]; None: it did not land.
        target: [m], of a launch that a policy aimed.
        method: Whose policy; "" of a launch that nobody aimed, which every method predicts.
    """

    draw: Annotated[tuple[float, float], LIST]
    landing: float | None
    target: float | None
    method: str = ""


def read_scores(folder: Path, band: str, params: Settings) -> list[Measured]:
    """A band's measured launches, from its CSV in `folder`; none where it has no file.

    Raises:
        UserError: A file is no band's, or the band's own cannot be used.
    """
    path = table.file_of(folder, band, params.bands)
    return read_measured(path, params.methods) if path else []


def read_measured(path: Path, methods: Collection[str]) -> list[Measured]:
    """Measured launches of a CSV.

    Nobody aimed a launch without a method, so its target, if any, is left out: such launches are
    held against predictions alone.

    Args:
        methods: Of params.yaml; a row that names another is refused.

    Raises:
        UserError: The file cannot be read, or a row says what no launch can have done.
    """
    launches = []
    for row in table.rows(path, "scores"):
        where, method = row.where, row.cells["method"]
        if method and method not in methods:
            raise UserError(
                f"{where}: method {method!r} is not in params.yaml, which has"
                f" {', '.join(methods)}; leave it empty for a launch that no policy aimed"
            )
        target = table.metres(where, table.TARGET, row.cells[table.TARGET])
        target = target if method else None
        if target is not None and not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
            raise UserError(
                f"{where}: target_m {target} lies outside the target on the floor,"
                f" {list(TARGET_AREA)}, where every landing counts as failed"
            )
        launches.append(Measured(draw=row.draw, landing=row.landing, target=target, method=method))
    return launches


class ScoresFile(JsonRecord):
    launches: list[Measured]


def save_scores(path: Path, launches: Sequence[Measured]) -> None:
    """Write a `ScoresFile`."""
    write_json(path, {"launches": [launch.model_dump() for launch in launches]})


def load_scores(path: Path) -> list[Measured]:
    """The launches of a `ScoresFile`. Raises NotMade."""
    return read_json(path, ScoresFile).launches
