"""A table is (heads, rows) of strings; numbers become text here.

Centimetres, milliseconds and per cent appear in tables and nowhere else.
"""

from __future__ import annotations

import numpy as np

Table = tuple[list[str], list[list[str]]]
NONE = "–"


def markdown(table: Table) -> str:
    heads, rows = table
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def number(value: float | None, form: str, otherwise: str | None = NONE) -> str:
    """`value` in a format such as ".3f", or `otherwise` where there is none."""
    if value is not None and np.isfinite(value):
        return format(value, form)
    return otherwise if isinstance(otherwise, str) else NONE


def percent(fraction: float, form: str = ".0f") -> str:
    return f"{100 * fraction:{form}} %"
