"""What parameters and derived quantities are called, and the units in which people read them."""

from __future__ import annotations

from sling2sim2real.base.parameters import TABLE

QUANTITIES = {row.name: row for row in TABLE}  # in the order of the cards


def coordinate(name: str) -> str:
    """A coordinate of the density (identification/posterior/coordinates.py) in words."""
    plain = name.removeprefix("log_")
    words = QUANTITIES[plain].symbol if plain in QUANTITIES else plain.replace("_", " ")
    return words if plain == name else f"log {words}"


def rounded(value: float, digits: int = 3) -> float:
    """Round to so many significant digits: another kind of CPU differs beyond them."""
    return float(f"{value:.{digits}g}")
