"""A table is (heads, rows) of strings, as Markdown; numbers become text here.

Centimetres, milliseconds and per cent appear in tables and nowhere else.
"""

from __future__ import annotations

import re

import numpy as np

Table = tuple[list[str], list[list[str]]]
NONE = "–"
MINUS = re.compile(r"(?<![\w.])-(?=\d)")  # before a number, not in 1E-3


def markdown(table: Table | None, repeats: bool = True) -> str:
    """Write a table as markdown; "" of None.

    Without `repeats`, first cells that repeat those above are blank.
    """
    if table is None:
        return ""
    heads, rows = table
    rows = rows if repeats else without_repeats(rows)
    rows = [[MINUS.sub("−", cell) for cell in row] for row in rows]
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def without_empty(table: Table) -> Table:
    """Without the columns that have no number in any row."""
    heads, rows = table
    filled = [n for n in range(len(heads)) if any(row[n] != NONE for row in rows)]
    return [heads[n] for n in filled], [[row[n] for n in filled] for row in rows]


def without_repeats(rows: list[list[str]]) -> list[list[str]]:
    """Rows whose first two cells are blank where they repeat those of the row above."""
    shown = []
    for above, row in zip([None, *rows], rows, strict=False):
        same = 0
        while above and same < 2 and row[same] == above[same]:
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
