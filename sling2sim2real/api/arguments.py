"""Arguments that are refused where they are given: one sentence with the argument's name."""

from __future__ import annotations

import numpy as np

from sling2sim2real.base.errors import UserError

USUAL = {"diameter": 0.010, "rest_length": 0.52}  # m, of a band that nobody has measured


def number(name: str, value: object, low: float, high: float, unit: str = "m") -> float:
    """A finite number in a closed range. Raises UserError."""
    if isinstance(value, (int, float, np.number)) and low <= value <= high:
        return float(value)
    raise UserError(f"{name}: must be a number from {low:g} to {high:g} {unit}, got {value!r}")


def drawn(value: object, floor: float) -> tuple[float, float]:
    """A drawn position (y, z), behind the fork and above the floor [m]. Raises UserError."""
    try:
        y, z = np.asarray(value, float)
    except (TypeError, ValueError):
        y = z = np.nan
    if not (y < 0 and floor < z < np.inf):
        raise UserError(
            f"draw: must be (y, z) with y < 0 and z > {floor:g} (the floor), got {value}"
        )
    return float(y), float(z)
