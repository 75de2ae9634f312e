"""A table is (heads, rows) of strings; numbers become text here.

Centimetres, milliseconds and per cent appear in tables and nowhere else.
"""

from __future__ import annotations

import numpy as np

Table = tuple[list[str], list[list[str]]]
NONE = "–"


def markdown(table: Table, repeats: bool = True) -> str:
    """As markdown; without `repeats`, first cells that repeat those above are blank."""
    heads, rows = table
    rows = rows if repeats else without_repeats(rows)
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def without_repeats(rows: list[list[str]], columns: int = 2) -> list[list[str]]:
    """Rows whose first cells are blank where they repeat those of the row above."""
    shown = []
    for above, row in zip([None, *rows], rows, strict=False):
        same = 0
        while above and same < columns and row[same] == above[same]:
            same += 1
        shown.append([""] * same + row[same:])
    return shown


def number(value: float | None, form: str, otherwise: str | None = NONE) -> str:
    """`value` in a format such as ".3f", or `otherwise` where there is none."""
    if value is not None and np.isfinite(value):
        return format(value, form)
    return otherwise if isinstance(otherwise, str) else NONE


def centimetres(metres: float | None) -> str:
    return number(None if metres is None else 100 * metres, ".2f")


def percent(fraction: float, form: str = ".0f") -> str:
    return f"{100 * fraction:{form}} %"
