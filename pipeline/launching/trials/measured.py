"""Launches that a user measured: data/trials/measured/<band>.csv (format: README.md beside it)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from pipeline.base import launch_table as table
from pipeline.base.errors import UserError
from pipeline.base.target import TARGET_AREA

REQUIRED, OPTIONAL = table.SCORES
LIMITS = {**table.LIMITS, "target_m": (0, 20, "beyond the fork")}


@dataclass(frozen=True)
class Measured:
    """One launch: draw (y, z) [m], landing [m] (None: it did not land), target [m] if aimed."""

    draw: tuple[float, float]
    landing: float | None
    target: float | None


def named(path: Path) -> Counter[str]:
    """How many launches of a measured CSV name each method; "" stands for none.

    Raises:
        UserError: The file cannot be read.
    """
    return Counter(row["method"] for _, row in table.rows(path, REQUIRED, OPTIONAL))


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
    for line, row in table.rows(path, REQUIRED, OPTIONAL):
        where = f"{path}, line {line}"
        if row["method"] and row["method"] not in known:
            raise UserError(
                f"{where}: method {row['method']!r} is not in params.yaml, which has"
                f" {', '.join(known)}; leave it empty for a launch that no policy aimed"
            )
        draw = table.drawn(where, row)
        landing, target = (
            table.metres(where, name, row[name], LIMITS) for name in (table.LANDING, "target_m")
        )
        target = target if row["method"] else None
        if target is not None and not TARGET_AREA[0] <= target <= TARGET_AREA[1]:
            raise UserError(
                f"{where}: target_m {target} lies outside the target on the floor,"
                f" {list(TARGET_AREA)}, where every landing counts as failed"
            )
        if row["method"] in ("", method):
            launches.append(Measured(draw, landing, target))
    return launches
