"""A band's values with their intervals, as people read them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.identify.posterior.coordinates import MOST_DRAG, MOST_LOST
from pipeline.report.quantities import QUANTITIES, rounded
from pipeline.simulator.parameters import EXTRA


@dataclass(frozen=True)
class ShownValue:
    """One value in its quantity's unit; `low` and `high` are None where no interval is known."""

    name: str
    label: str
    unit: str
    value: float
    low: float | None
    high: float | None
    fixed: bool


def values(theta: dict, fixed: dict[str, float]) -> list[ShownValue]:
    """Of a θ file's content, in the order of QUANTITIES.

    Args:
        fixed: Parameters that the method did not search.
    """
    told = theta.get("confidence") or {}
    intervals = {**told.get("derived", {}), **told.get("parameters", {})}
    known = theta["theta"] | {"air_drag": theta.get("nuisances", {}).get("air_drag") or 0.0}
    known |= {name: theta[name] for name in EXTRA if name in theta}
    if not told:  # nothing was searched but θ
        known = theta["theta"]
    found = []
    for name, quantity in QUANTITIES.items():
        if name not in known:
            continue
        numbers = known[name], *(intervals.get(name, {}).get(end) for end in ("low", "high"))
        shown = [None if x is None else rounded(quantity.factor * x) for x in numbers]
        still = name in fixed
        ends = (None, None) if still else shown[1:]
        found.append(ShownValue(name, quantity.label, quantity.unit, shown[0], *ends, still))
    return found


def boxes(params, method: str) -> dict[str, tuple[float, float, str]]:
    """Low and high end in SI, and scale, of what a method searches, by name."""
    about = params.methods[method]
    known = {name: (box.low, box.high, box.scale) for name, box in params.parameters}
    known |= {name: (*ends, "linear") for name, ends in about.bounds.items()}
    known |= {
        "air_drag": (0.0, MOST_DRAG, "linear"),
        "turn_damping": (0.0, 1.0, "linear"),
        "returned_share": (np.exp(-MOST_LOST), np.exp(MOST_LOST), "log"),
    }
    return {name: box for name, box in known.items() if name not in about.fixed}
